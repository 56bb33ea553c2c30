/* A photograph resampled to the square that a part of it is. */
#ifndef IO_WARP_H
#define IO_WARP_H
#include "data/image/image.h"
#include "data/image/photo_rows.h"

/* The pixel (io_pinhole's convention) that the point of the square is seen at; the square is [0, 1]^2, y down. */
typedef struct io_view_of {
    void (*pixel)(const double point[2], double pixel[2], const void *user);
    const void *user;
} io_view_of;

/* square: size x size pixels, linear, which the caller frees. Each is the mean of the photograph over the pixel's
 * picture in it, as many points of linear interpolation as it is long in pixels, 64 at most either way; where it is
 * smaller than a pixel, one. Beyond the photograph its edge goes on. The rows that are needed are held as floats.
 * threads: 0 is the process's number. */
ts_code io_warp(const io_photo_rows *photo, const io_view_of *view, int size, int threads, io_image *square,
                ts_status *st);

/* Linear interpolation of the photograph at a pixel, rgb. */
void io_photo_at(const io_photo_rows *photo, const double pixel[2], float rgb[3]);
#endif
