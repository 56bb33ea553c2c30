/* EXIF and profile of a WebP file (WebP container specification). OpenImageIO expects "Exif" and two zeros before the
 * EXIF's TIFF header, as some programs write, and passes over what has none; the profile it does not read. */
#include "data/image/common_read.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER = 12, CHUNK = 8, PREFIX = 6, MOST = 1 << 24, PROFILE_LEAST = 128 };

/* The content of the chunk of that name, malloced, after so many bytes for the caller; NULL: there is none. */
static unsigned char *find(FILE *f, const char *name, size_t before, size_t *size)
{
    unsigned char head[HEADER];
    if (fseek(f, 0, SEEK_SET) || fread(head, 1, HEADER, f) != HEADER || memcmp(head, "RIFF", 4) ||
        memcmp(head + 8, "WEBP", 4))
        return NULL;
    for (long at = HEADER; !fseek(f, at, SEEK_SET) && fread(head, 1, CHUNK, f) == CHUNK;) {
        const size_t length = head[4] | (size_t)head[5] << 8 | (size_t)head[6] << 16 | (size_t)head[7] << 24;
        at += CHUNK + (long)(length + (length & 1));
        if (memcmp(head, name, 4)) continue;
        unsigned char *bytes = length > PREFIX && length <= MOST ? malloc(before + length) : NULL;
        if (bytes && fread(bytes + before, 1, length, f) == length) {
            *size = length;
            return bytes;
        }
        free(bytes);
        return NULL;
    }
    return NULL;
}

static void take_exif(unsigned char *bytes, size_t size, oi_image *image)
{
    int orientation;
    bool adobe;
    io_lens lens;
    memcpy(bytes, "Exif\0\0", PREFIX);
    if (memcmp(bytes + PREFIX, "Exif", 4) == 0) memmove(bytes, bytes + PREFIX, size);
    else size += PREFIX;
    if (!io_exif(bytes, size, &orientation, &adobe, &lens)) return;
    image->orientation = orientation;
    image->adobe = adobe;
    image->lens = lens;
}

void io_webp_chunks(const char *path, oi_image *image)
{
    FILE *f = fopen(path, "rbe");
    size_t size = 0;
    unsigned char *exif = f ? find(f, "EXIF", PREFIX, &size) : NULL;
    if (exif) take_exif(exif, size, image);
    free(exif);
    unsigned char *profile = f && !image->icc ? find(f, "ICCP", 0, &size) : NULL;
    if (profile && size > PROFILE_LEAST) image->icc = profile, image->icc_size = size;
    else free(profile);
    if (f) fclose(f);
}
