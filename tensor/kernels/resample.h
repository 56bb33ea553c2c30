/* The two passes of a separable resampling: rows combined, then pixels of a row combined. */
#ifndef TS_KERNELS_RESAMPLE_H
#define TS_KERNELS_RESAMPLE_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stdint.h>

struct ts_resample_kernels {
    /* y[i] = sum over k < count of weight[k] x[k stride + i], i < n */
    void (*rows)(int64_t n, int count, const float *weight, const float *x, int64_t stride, float *y);
    /* y[j][0 .. c-1] (+)= sum over k of weight[offset[j] + k] x[first[j] + k][0 .. c-1], k < offset[j + 1] - offset[j],
     * j < w */
    void (*pixels)(int w, int c, const int *first, const int *offset, const float *weight, const float *x, float *y,
                   bool accumulate);
};
TS_FAMILY(resample)

/* The same in plain C, for tests. */
extern const struct ts_resample_kernels ts_resample_naive;
#endif
