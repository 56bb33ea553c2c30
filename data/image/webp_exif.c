/* The EXIF of a WebP file (WebP container specification): a chunk that begins with the TIFF header. OpenImageIO expects
 * "Exif" and two zeros before it, as some programs write, and passes over what has none. */
#include "data/image/common_read.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER = 12, CHUNK = 8, PREFIX = 6, MOST = 1 << 20 };

/* The segment as io_exif wants it, malloced; NULL: there is none. */
static unsigned char *find(FILE *f, size_t *size)
{
    unsigned char head[HEADER];
    if (fread(head, 1, HEADER, f) != HEADER || memcmp(head, "RIFF", 4) || memcmp(head + 8, "WEBP", 4)) return NULL;
    for (long at = HEADER; !fseek(f, at, SEEK_SET) && fread(head, 1, CHUNK, f) == CHUNK;) {
        const size_t length = head[4] | (size_t)head[5] << 8 | (size_t)head[6] << 16 | (size_t)head[7] << 24;
        at += CHUNK + (long)(length + (length & 1));
        if (memcmp(head, "EXIF", 4)) continue;
        unsigned char *bytes = length > PREFIX && length <= MOST ? malloc(PREFIX + length) : NULL;
        if (!bytes) return NULL;
        memcpy(bytes, "Exif\0\0", PREFIX);
        if (fread(bytes + PREFIX, 1, length, f) != length) {
            free(bytes);
            return NULL;
        }
        *size = PREFIX + length;
        if (memcmp(bytes + PREFIX, "Exif", 4) == 0) memmove(bytes, bytes + PREFIX, *size -= PREFIX);
        return bytes;
    }
    return NULL;
}

void io_webp_exif(const char *path, oi_image *image)
{
    FILE *f = fopen(path, "rbe");
    size_t size = 0;
    unsigned char *segment = f ? find(f, &size) : NULL;
    int orientation;
    bool adobe;
    io_lens lens;
    if (segment && io_exif(segment, size, &orientation, &adobe, &lens)) {
        image->orientation = orientation;
        image->adobe = adobe;
        image->lens = lens;
    }
    free(segment);
    if (f) fclose(f);
}
