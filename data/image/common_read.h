/* Ordinary PNG and JPEG photographs, read with libpng and libjpeg. */
#ifndef IO_COMMON_READ_H
#define IO_COMMON_READ_H
#include "data/image/oiio.h"

/* *read: image is what oi_read would give, the same values, and the caller's to free. Otherwise image is empty: the
 * file has another format, or is unusual or damaged, and the caller asks oi_read, which also reports the error. What
 * claims more than max_pixels, or pixels that need more memory than there is, is refused here: TS_UNSUPPORTED,
 * TS_NOMEM. */
ts_code io_read_png_file(const char *path, int64_t max_pixels, oi_image *image, bool *read,
                         ts_status *st); /* 8 and 16 bits, grey or RGB, with alpha or without */
ts_code io_read_jpeg_file(const char *path, int64_t max_pixels, oi_image *image, bool *read,
                          ts_status *st); /* grey and YCbCr or RGB, EXIF orientation, ICC profile */

/* Reads a JPEG's Exif segment (from its "Exif\0\0" on). False: it does not follow the standard. What is odd about the
 * lens is only not said. */
bool io_exif(const unsigned char *segment, size_t size, int *orientation, bool *adobe, io_lens *lens);

/* Of a file that oi_read has read, what OpenImageIO passes over: of WebP the EXIF and the profile, of HEIF and AVIF the
 * profile or code points of the primary image. Other files are left alone, and what is damaged is not said. */
void io_webp_chunks(const char *path, oi_image *image);
void io_heif_colours(const char *path, oi_image *image);
#endif
