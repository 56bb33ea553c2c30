/* A square on the sample, from its corners in a photograph. */
#ifndef IO_CORNERS_H
#define IO_CORNERS_H
#include "data/image/image.h"
#include "data/image/photo_rows.h"
#include "data/rectify/pinhole.h"

typedef struct io_corners {
    double at[4][2]; /* top left, top right, bottom right, bottom left; pixels, or all in 0 .. 1: shares of the
                        photograph's width and height */
} io_corners;

/* Four words "x,y", or one with all four between blanks. TS_INVALID; also where the lines between them cross. */
ts_code io_corners_parse(const char *const *words, int count, io_corners *corners, ts_status *st);

/* The square at size x size pixels, linear, which the caller frees; *camera: its place, for a picture whose shorter
 * side spans fov degrees; *side (may be NULL): of the square in the photograph, the mean of the four in pixels. */
ts_code io_corners_rectify(const io_photo_rows *photo, const io_corners *corners, double fov, int size, int threads,
                           io_image *square, io_pinhole *camera, double *side, ts_status *st);
#endif
