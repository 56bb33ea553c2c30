/* The only door to OpenImageIO: plain C types outside, no C++ exception leaves. */
#ifndef IO_OIIO_H
#define IO_OIIO_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#include "tensor/status.h"

/* The first page of a file, values as stored: integers / their maximum, floats as they are. */
typedef struct oi_image {
    int width, height, channels;
    float *data;                 /* [height][width][channels] */
    int colour[3], alpha;        /* channel numbers of red, green, blue (all the same when grey), of alpha or -1 */
    bool grey, floating;         /* floating: stored as half, float or double */
    bool associated;             /* the colours are multiplied by alpha already */
    int orientation;             /* EXIF, 1 to 8 */
    bool linear, adobe;          /* the file says: linear values; Adobe RGB (EXIF's interoperability index) */
    bool primaries;              /* chromaticities holds red, green, blue, white as x, y */
    float chromaticities[8];
    unsigned char *icc;          /* ICC profile, or NULL */
    size_t icc_size;
} oi_image;

/* The size is checked against max_pixels before memory is taken. On success the caller calls oi_free. */
ts_code oi_read(const char *path, int64_t max_pixels, oi_image *image, ts_status *st);
void oi_free(oi_image *image);

/* Encodes in memory. format "png" (bits 8 or 16) or "jpeg" (8); pixels are uint8_t or uint16_t [height][width][channels]. srgb: the file is
 * tagged so. bytes is malloced and the caller's. name is for messages. */
typedef struct oi_encoding {
    const char *format;
    int width, height, channels, bits, quality;
    bool srgb;
} oi_encoding;
ts_code oi_encode(const char *name, const oi_encoding *e, const void *pixels, unsigned char **bytes, size_t *size, ts_status *st);

/* Whether some reader claims this file name extension (without the dot). */
bool oi_knows_extension(const char *extension);

#ifdef __cplusplus
}
#endif
#endif
