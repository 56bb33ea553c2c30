/* Resampling of images outside the tape: separable triangle filter, widened by the scale factor when shrinking (so that
 * it averages, as an antialiased "bilinear" resize does), half-pixel centres, edges clamped. */
#ifndef TS_RESIZE_H
#define TS_RESIZE_H
#include "tensor/tensor.h"

/* dst = src resampled; same n and c, both contiguous, no overlap. Threaded. scratch comes from the arena and is given
 * back. */
ts_code ts_resize(ts_tensor *dst, const ts_tensor *src, ts_arena *arena, int threads, ts_status *st);
#endif
