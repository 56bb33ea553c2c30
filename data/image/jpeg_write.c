#include "data/image/jpeg_write.h"
#include "data/file.h"
#include "data/image/oiio.h"
#include <stdlib.h>
#include <string.h>

enum { SEGMENT = 54, FOCAL_AT = 46 };

/* APP1: an Exif directory whose one entry is the camera's, whose one entry is the focal length (Exif 2.32, 4.5). */
static const unsigned char segment[SEGMENT] = {
    0xff, 0xe1, 0,    SEGMENT - 2, 'E', 'x', 'i', 'f', 0, 0, 'I', 'I', '*', 0, 8, 0, 0, 0, /* first directory at 8 */
    1,    0,    0x69, 0x87,        4,   0,   1,   0,   0, 0, 26,  0,   0,   0, 0, 0, 0, 0, /* the camera's at 26 */
    1,    0,    0x05, 0xa4,        3,   0,   1,   0,   0, 0, 0,   0,   0,   0, 0, 0, 0, 0};

ts_code io_write_phone_jpeg(const char *path, int width, int height, const uint8_t *codes, int quality, int focal_35mm,
                            ts_status *st)
{
    const oi_encoding e = {width, height, 3, quality};
    unsigned char *bytes = NULL;
    size_t size = 0;
    ts_code code = oi_encode_jpeg(path, &e, codes, &bytes, &size, st);
    unsigned char *file = code ? NULL : malloc(size + SEGMENT);
    if (!code && !file) code = ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    if (!code) {
        size_t from = 2, to = 2 + SEGMENT;
        memcpy(file, bytes, 2);
        memcpy(file + 2, segment, SEGMENT);
        file[2 + FOCAL_AT] = (unsigned char)(focal_35mm & 255);
        file[2 + FOCAL_AT + 1] = (unsigned char)(focal_35mm >> 8);
        /* the encoder's own segments, its Exif left out: two are unusual */
        while (from + 4 <= size && bytes[from] == 0xff && bytes[from + 1] >= 0xe0 && bytes[from + 1] <= 0xef) {
            const size_t length = 2 + ((size_t)bytes[from + 2] << 8 | bytes[from + 3]);
            if (from + length > size) break;
            if (bytes[from + 1] != 0xe1) {
                memcpy(file + to, bytes + from, length);
                to += length;
            }
            from += length;
        }
        memcpy(file + to, bytes + from, size - from);
        code = io_write_bytes(path, file, to + size - from, st);
    }
    free(file);
    free(bytes);
    return code;
}
