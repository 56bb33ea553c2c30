/* What a file's header says before anything is decoded. */
#ifndef IO_HEADER_H
#define IO_HEADER_H
#include "tensor/status.h"
#include <stdint.h>

/* TS_UNSUPPORTED where there are more than max_pixels, TS_NOMEM where a decoder's bytes are not to be had. */
ts_code io_check_claim(const char *path, double width, double height, int64_t max_pixels, double bytes, ts_status *st);

/* TS_UNSUPPORTED where a Netpbm, Radiance, BMP, GIF, Photoshop, TIFF or OpenEXR file claims more than max_pixels. Other
 * files, and headers that make no sense, pass: what reads them reports the error. */
ts_code io_check_header(const char *path, int64_t max_pixels, ts_status *st);
#endif
