/* The photographs that nearly everybody has, read by libpng and libjpeg alone. */
#ifndef IO_COMMON_READ_H
#define IO_COMMON_READ_H
#include "data/image/oiio.h"

/* True: image is what oi_read would give, the same values, and the caller's to free. False: the file is of another
 * format, or anything about it is unusual, too large or damaged; image is empty and oi_read is to be asked, which also
 * has the words for what is wrong. */
bool io_read_png_file(const char *path, int64_t max_pixels,
                      oi_image *image); /* 8 and 16 bits, grey or RGB, with alpha or without */
bool io_read_jpeg_file(const char *path, int64_t max_pixels,
                       oi_image *image); /* grey and YCbCr or RGB, EXIF orientation, ICC profile */

/* What a JPEG's Exif segment (from its "Exif\0\0" on) says about the picture. False: it is not as the standard has it.
 */
bool io_exif(const unsigned char *segment, size_t size, int *orientation, bool *adobe);
#endif
