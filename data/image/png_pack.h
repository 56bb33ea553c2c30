/* The bytes of a PNG file, from rows as they stand in it. */
#ifndef IO_PNG_PACK_H
#define IO_PNG_PACK_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>

typedef struct io_png_pack io_png_pack;

/* channels: 1 grey, 2 with alpha, 3 RGB, 4 with alpha; bits: 8 or 16; srgb: the file is tagged so. name is for messages
 * and lives until the end. NULL and st on failure. */
io_png_pack *io_png_pack_begin(const char *name, int width, int height, int channels, int bits, bool srgb,
                               ts_status *st);
/* The next row, width * channels values, big-endian where they have two bytes. */
ts_code io_png_pack_row(io_png_pack *p, const unsigned char *row, ts_status *st);
/* After the last row: bytes is malloced and the caller's. */
ts_code io_png_pack_end(io_png_pack *p, unsigned char **bytes, size_t *size, ts_status *st);
/* At any time, and nulls the pointer; NULL is left alone. */
void io_png_pack_free(io_png_pack **p);
#endif
