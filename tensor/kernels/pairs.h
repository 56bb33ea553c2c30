/* Floats rounded to the nearest bf16, ties to even, NaNs quiet, and put in pairs where a float would be, the even one
 * in the low half: what the products of bf16 in tensor/kernels/conv.h read. */
#ifndef TS_KERNELS_PAIRS_H
#define TS_KERNELS_PAIRS_H
#include "tensor/kernels/family.h"
#include <stddef.h>
#include <stdint.h>

struct ts_pairs_kernels {
    /* to[p stride + i] = channels 2i and 2i + 1 of pixel p; the last pair of an odd number of channels ends with a
     * zero. */
    void (*of_channels)(const float *x, int64_t pixels, int channels, float *to, ptrdiff_t stride);
    /* to[p to_step + i] = even[p step + i] and odd[p step + i], i < count; zeros up to i < width. odd == NULL: zeros.
     * Denormals are whatever the instruction set makes of them. */
    void (*of_two)(const float *even, const float *odd, ptrdiff_t step, int64_t pixels, int64_t count, int64_t width,
                   float *to, ptrdiff_t to_step);
};
TS_FAMILY(pairs)
#endif
