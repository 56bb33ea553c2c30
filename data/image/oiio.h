/* The only interface to OpenImageIO: plain C types, no C++ exception leaves it. It is in a shared object that is loaded
 * at the first call that needs it (data/image/image_library.c): Debian's build loads about 260 libraries, which takes a
 * quarter of a second. */
#ifndef IO_OIIO_H
#define IO_OIIO_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "data/image/lens.h"

#ifdef __cplusplus
extern "C" {
#endif
#include "tensor/status.h"

typedef enum oi_type { OI_F32, OI_U8, OI_U16 } oi_type;

/* The first page of a file, values as stored: OI_F32: integers / their maximum, floats as they are; OI_U8, OI_U16: the
 * integers themselves. */
typedef struct oi_image {
    int width, height, channels;
    oi_type type;
    void *data;           /* [height][width][channels] */
    int colour[3], alpha; /* channel numbers of red, green, blue (all the same when grey), of alpha or -1 */
    bool grey, floating;  /* floating: stored as half, float or double */
    int levels;           /* number of values of an integer file: 256 or 65536 (more are rounded to that) */
    bool associated;      /* the colours are multiplied by alpha already */
    int orientation;      /* EXIF, 1 to 8 */
    bool linear, adobe;   /* the file says: linear values; Adobe RGB (EXIF's interoperability index) */
    bool primaries;       /* chromaticities holds red, green, blue, white as x, y */
    float chromaticities[8];
    unsigned char *icc; /* ICC profile, or NULL */
    size_t icc_size;
    bool code_points; /* code_point holds primaries and transfer as of ITU-T H.273 */
    int code_point[2];
    io_lens lens;
} oi_image;

/* The i-th value of data as OI_F32 would have it. */
static inline float oi_value(const oi_image *image, size_t i)
{
    switch (image->type) {
    case OI_U8: return (float)((const uint8_t *)image->data)[i] * (1.0f / 255);
    case OI_U16: return (float)((const uint16_t *)image->data)[i] * (1.0f / 65535);
    default: return ((const float *)image->data)[i];
    }
}

/* The size is checked against max_pixels, and the memory of its pixels against max_bytes, before memory is taken. On
 * success the caller calls oi_free. */
ts_code oi_read(const char *path, int64_t max_pixels, double max_bytes, oi_image *image, ts_status *st);
void oi_free(oi_image *image);

/* Encodes a JPEG in memory; pixels are uint8_t [height][width][channels]. bytes is malloced and the caller's. name is
 * for messages. */
typedef struct oi_encoding {
    int width, height, channels, quality;
} oi_encoding;
ts_code oi_encode_jpeg(const char *name, const oi_encoding *e, const uint8_t *pixels, unsigned char **bytes,
                       size_t *size, ts_status *st);

/* Whether a reader exists for this file name extension (without the dot). False also where the library cannot be
 * loaded.
 */
bool oi_knows_extension(const char *extension);

/* What the shared object exports under the name OI_LIBRARY: build says whether it belongs to this program. */
typedef struct oi_library {
    const char *build;
    void (*start)(void); /* once, before the others */
    ts_code (*read)(const char *path, int64_t max_pixels, double max_bytes, oi_image *image, ts_status *st);
    ts_code (*encode_jpeg)(const char *name, const oi_encoding *e, const uint8_t *pixels, unsigned char **bytes,
                           size_t *size, ts_status *st);
    bool (*knows_extension)(const char *extension);
} oi_library;
#define OI_LIBRARY "lgd_image_library"
#define OI_BUILD "lgd " LGD_VERSION " image library 5"

#ifdef __cplusplus
}
#endif
#endif
