/* A reader for the readers of data/. */
#ifndef IO_IMAGE_READ_H
#define IO_IMAGE_READ_H
#include "data/image/image.h"
#include <math.h>

/* NaN and what is negative become 0, infinity the largest half float: they would spread in every average. */
static inline float io_light(float v) { return v > 0 ? fminf(v, 65504) : 0; }

/* A colour map: linear sRGB as from io_read_photo, but orientation and alpha are ignored, as for the other maps. */
ts_code io_read_colour_map(const char *path, int64_t max_pixels, io_image *image, ts_status *st);
#endif
