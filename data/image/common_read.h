/* Ordinary PNG and JPEG photographs, read with libpng and libjpeg. */
#ifndef IO_COMMON_READ_H
#define IO_COMMON_READ_H
#include "data/image/oiio.h"

/* True: image is what oi_read would give, the same values, and the caller's to free. False: the file has
 * another format, or is unusual, too large or damaged; image is empty. The caller then asks oi_read, which also reports
 * the error. */
bool io_read_png_file(const char *path, int64_t max_pixels,
                      oi_image *image); /* 8 and 16 bits, grey or RGB, with alpha or without */
bool io_read_jpeg_file(const char *path, int64_t max_pixels,
                       oi_image *image); /* grey and YCbCr or RGB, EXIF orientation, ICC profile */

/* Reads a JPEG's Exif segment (from its "Exif\0\0" on). False: it does not follow the standard. What is odd about the
 * lens is only not said. */
bool io_exif(const unsigned char *segment, size_t size, int *orientation, bool *adobe, io_lens *lens);

/* Of a WebP file that oi_read has read: what its EXIF says. Other files are left alone. */
void io_webp_exif(const char *path, oi_image *image);
#endif
