/* Statistics per channel over the pixels of one image, x: [pixels][c], and the normalisation that uses them. Sums are
 * float over short runs of pixels and double beyond, so that 4096^2 pixels lose nothing. */
#ifndef TS_NORM_H
#define TS_NORM_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stdint.h>

struct ts_norm_kernels {
    void (*sums)(int64_t pixels, int c, const float *x, double *sum); /* sum[c] += */
    /* mean[c] and m2[c] = sum of (x - mean)^2, both overwritten; two passes, so pixels should fit the cache */
    void (*moments)(int64_t pixels, int c, const float *x, double *mean, double *m2);
    /* y = ((x - high) - low) scale; high + low is the mean in two floats, since one loses bits when the mean is far
     * from zero */
    void (*normalise)(int64_t pixels, int c, const float *x, const float *high, const float *low, const float *scale,
                      float *y);
    /* sum_dy[c] += dy, sum_dyy[c] += dy y */
    void (*gradient_sums)(int64_t pixels, int c, const float *y, const float *dy, double *sum_dy, double *sum_dyy);
    /* dx (+)= scale (dy - a - b y) */
    void (*gradient)(int64_t pixels, int c, const float *y, const float *dy, const float *a, const float *b,
                     const float *scale, float *dx, bool accumulate);
};
TS_FAMILY(norm)

/* The same in plain C, for tests. */
extern const struct ts_norm_kernels ts_norm_naive;
#endif
