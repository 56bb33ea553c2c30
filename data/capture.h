/* Photographs of one flat sample under known lights and cameras, in the folder layout of MaterialGAN (Guo et al.,
 * "MaterialGAN: Reflectance Capture using a Generative SVBRDF Model", 2020):
 *
 *   00.png, 01.png, ...   gamma 2.2, rectified: the sample fills each picture
 *   camera_pos.txt        one "x,y,z" a picture, in centimetres; origin at the sample's centre, x right, y up, z the
 *                         sample's normal
 *   light_pos.txt         the same of the light
 *   image_size.txt        the sample's side in centimetres
 *   light_power.txt       "r,g,b": radiance = BRDF max(n.l, 0) power / distance^2, distance in centimetres
 */
#ifndef IO_CAPTURE_H
#define IO_CAPTURE_H
#include "data/image/image.h"
#include "data/levels.h"

enum { IO_CAPTURE_IMAGES = 100 };

/* What is known of a picture as its file has it. */
typedef struct io_capture_source {
    char *file;       /* its path, owned; NULL: it is from none */
    int side;         /* of the square in that file, in pixels */
    io_levels levels; /* of the square, before any gain */
} io_capture_source;

typedef struct io_capture {
    int images, size;
    float *image; /* owned, [images][size][size][3], linear, in [0, 1] */
    float camera[IO_CAPTURE_IMAGES][3], light[IO_CAPTURE_IMAGES][3]; /* patch widths */
    float power[3];                                                  /* with distances in patch widths */
    float side;                                                      /* of the sample, centimetres */
    io_capture_source source[IO_CAPTURE_IMAGES];
    char name[128];
    char profile[96], profile_of[128]; /* a colour profile that cannot be used and the first photograph that has it:
                                          sRGB is assumed; empty: there is none */
} io_capture;

/* images pictures of size x size, all zero, side 1. */
ts_code io_capture_create(io_capture *c, int images, int size, ts_status *st);
/* Fills the picture's source; square: [size][size][3], linear. */
ts_code io_capture_note(io_capture *c, int picture, const char *file, int side, const float *square, ts_status *st);
void io_capture_free(io_capture *c); /* and zeroes the struct */

/* Pictures are resampled to size x size in linear light (0: the size of the first). A file that is missing, not square
 * or has the wrong number of lines, and a position not above the sample, are errors that name the file, as is a picture
 * of more than max_pixels. c is empty after a failure. */
ts_code io_read_capture(const char *folder, int size, int64_t max_pixels, io_capture *c, ts_status *st);
/* Whether the folder has a camera_pos.txt. */
bool io_is_capture(const char *folder);

/* Into an existing folder, 8-bit PNG. */
ts_code io_write_capture(const char *folder, const io_capture *c, ts_status *st);
#endif
