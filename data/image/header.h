/* What a file's header says before anything is decoded. */
#ifndef IO_HEADER_H
#define IO_HEADER_H
#include "tensor/status.h"
#include <stdint.h>

/* TS_UNSUPPORTED where a Netpbm, Radiance, BMP, GIF, Photoshop, TIFF or OpenEXR file claims more than max_pixels. Other
 * files, and headers that make no sense, pass: what reads them reports the error. */
ts_code io_check_header(const char *path, int64_t max_pixels, ts_status *st);
#endif
