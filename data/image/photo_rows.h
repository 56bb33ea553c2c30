/* A photograph's pixels, upright and in linear light, row by row. The file's pixels are kept as stored, a quarter
 * of the memory of floats. */
#ifndef IO_PHOTO_ROWS_H
#define IO_PHOTO_ROWS_H
#include "data/image/colour.h"
#include "data/image/oiio.h"
#include "data/image/profile.h"

typedef struct io_photo_rows {
    int width, height; /* upright */
    oi_image raw;
    io_space space;
    int orientation;
    float *tables; /* [3][raw.levels]: the curve of every value of an integer file; where the colours need no matrix
                      (plain), the whole conversion */
    bool plain;
    io_profile *profile; /* NULL, or what takes the place of space */
    char unread[96];     /* empty, or the name of a profile that cannot be used: sRGB is assumed */
    bool transparent;    /* of a photograph: black shows through it somewhere */
} io_photo_rows;

/* As io_read_photo; photograph: turned by the file's orientation, over black where it is transparent. Of a colour map
 * neither counts: its alpha holds cut-outs or another map. On success the caller calls io_photo_close. */
ts_code io_photo_open(const char *path, int64_t max_pixels, bool photograph, io_photo_rows *p, ts_status *st);
void io_photo_close(io_photo_rows *p);

/* Pixels x .. x + count - 1 of row y, [count][3]. Any threads may ask at once. */
void io_photo_row(const io_photo_rows *p, int x, int y, int count, float *out);

/* The file as it is stored, whatever its format; the caller calls oi_free. */
ts_code io_read_raw(const char *path, int64_t max_pixels, oi_image *raw, ts_status *st);

/* Where the pixel at column x, row y of the upright image lies in the stored one of w x h pixels (Exif 2.3, 4.6.4 A,
 * Orientation). */
size_t io_stored_at(int orientation, int x, int y, int w, int h);
#endif
