/* Whole files. */
#ifndef IO_FILE_H
#define IO_FILE_H
#include "tensor/status.h"
#include <stddef.h>

/* Writes a temporary file in the same folder, syncs it and renames it to path: a reader sees the old file or the whole
 * new one, and after a failure nothing is left behind. That the new name survives a power cut too is io_sync_folder's,
 * once for all files of a folder. A path that exists and is no regular file (a device, a pipe) is written to directly;
 * a symbolic link is followed. */
ts_code io_write_bytes(const char *path, const void *bytes, size_t size, ts_status *st);

/* The names in folder reach the disk. Failure is none of what was written. */
void io_sync_folder(const char *folder);

/* The whole file, with a zero byte after its end; malloced, the caller frees it. More than limit bytes are an error. */
ts_code io_read_bytes(const char *path, size_t limit, char **bytes, size_t *size, ts_status *st);

/* That path is a readable regular file that is not empty; otherwise one line that says what it is. */
ts_code io_check_file(const char *path, ts_status *st);
#endif
