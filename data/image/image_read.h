/* Readers that only the other readers of data/ need. */
#ifndef IO_IMAGE_READ_H
#define IO_IMAGE_READ_H
#include "data/image/image.h"

/* A colour map: to linear sRGB as io_read_photo, but never turned, since the maps beside it are not. */
ts_code io_read_colour_map(const char *path, int64_t max_pixels, io_image *image, ts_status *st);
#endif
