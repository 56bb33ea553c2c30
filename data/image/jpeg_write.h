/* JPEG files as a phone writes them. */
#ifndef IO_JPEG_WRITE_H
#define IO_JPEG_WRITE_H
#include "tensor/status.h"
#include <stdint.h>

/* codes: [height][width][3], sRGB. The file's Exif says FocalLengthIn35mmFilm and nothing else. Written as
 * io_write_bytes does. */
ts_code io_write_phone_jpeg(const char *path, int width, int height, const uint8_t *codes, int quality, int focal_35mm,
                            ts_status *st);
#endif
