/* Maps that repeat without a visible border. */
#ifndef IO_SEAMLESS_H
#define IO_SEAMLESS_H
#include "data/material.h"

/* The overlap's part of the side, and the least side. */
enum { IO_SEAMLESS_PART = 8, IO_SEAMLESS_LEAST = 16 };

/* out: maps of the same size that continue at the opposite border, made of those of in; the caller frees it. The last
 * eighth of the columns is laid over the first and cut along the path on which all maps together differ least (Efros
 * and Freeman, "Image Quilting for Texture Synthesis and Transfer", 2001); then the same is done with the rows, on a
 * path that closes. What is coarser than the overlap is faded across it (Burt and Adelson, "A Multiresolution Spline",
 * 1983), finer detail is cut. What is left, 7/8 of the side, is resampled to the size. Its border is laid where
 * neighbours differ least. TS_INVALID below the least side. threads: 0: the process's number. */
ts_code io_seamless(const io_material *in, io_material *out, int threads, ts_status *st);
#endif
