/* A reader for the readers of data/. */
#ifndef IO_IMAGE_READ_H
#define IO_IMAGE_READ_H
#include "data/image/image.h"

/* A colour map: linear sRGB as from io_read_photo, but orientation is ignored, as for the other maps. */
ts_code io_read_colour_map(const char *path, int64_t max_pixels, io_image *image, ts_status *st);
#endif
