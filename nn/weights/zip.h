/* A ZIP archive in memory (PKWARE's APPNOTE 6.3.10): stored and deflated entries, with the 64-bit extensions.
 * Everything in it is checked. */
#ifndef NN_ZIP_H
#define NN_ZIP_H
#include "nn/weights/file_internal.h"

typedef struct zip_entry {
    const char *name; /* length bytes of the archive */
    size_t length;
    uint64_t header, begin, packed,
        size; /* where its local header and its data lie, and their bytes there and unpacked */
    uint32_t crc;
    bool deflated;
    const unsigned char *data; /* unpacked; NULL until zip_data */
} zip_entry;

typedef struct zip_archive {
    zip_entry *entry; /* by name */
    int entries;
} zip_archive;

/* Reads f's directory: every entry's data lies inside the file, none overlaps another one, no name is there twice. The
 * caller frees after success and after failure. */
ts_code zip_open(nn_file *f, zip_archive *zip, ts_status *st);
void zip_free(zip_archive *zip);
zip_entry *zip_find(const zip_archive *zip, const char *name, size_t length); /* NULL when absent */

/* The entry's bytes: the file's own, or memory that belongs to f. The checksum of deflated entries must agree; that of
 * stored entries is ignored, as by PyTorch, which can write files without. NULL and st on failure. */
const unsigned char *zip_data(nn_file *f, zip_entry *e, ts_status *st);
#endif
