/* The naive twin of tensor/kernels/norm.c: plain loops, arithmetic in double. */
#include "tensor/kernels/norm.h"

static void sums(int64_t pixels, int c, const float *x, double *sum)
{
    for (int64_t i = 0; i < pixels * c; i++) sum[i % c] += x[i];
}

static void moments(int64_t pixels, int c, const float *x, double *mean, double *m2)
{
    for (int i = 0; i < c; i++) {
        mean[i] = m2[i] = 0;
        for (int64_t p = 0; p < pixels; p++) mean[i] += x[p * c + i] / (double)pixels;
        for (int64_t p = 0; p < pixels; p++) m2[i] += (x[p * c + i] - mean[i]) * (x[p * c + i] - mean[i]);
    }
}

static void normalise(int64_t pixels, int c, const float *x, const float *high, const float *low, const float *scale,
                      float *y)
{
    for (int64_t i = 0; i < pixels * c; i++) y[i] = (float)(((double)x[i] - high[i % c] - low[i % c]) * scale[i % c]);
}

static void gradient_sums(int64_t pixels, int c, const float *y, const float *dy, double *sum_dy, double *sum_dyy)
{
    for (int64_t i = 0; i < pixels * c; i++) {
        sum_dy[i % c] += dy[i];
        sum_dyy[i % c] += (double)dy[i] * y[i];
    }
}

static void gradient(int64_t pixels, int c, const float *y, const float *dy, const float *a, const float *b,
                     const float *scale, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < pixels * c; i++) {
        double d = scale[i % c] * ((double)dy[i] - a[i % c] - (double)b[i % c] * y[i]);
        dx[i] = (float)(accumulate ? dx[i] + d : d);
    }
}

const struct ts_norm_kernels ts_norm_naive = {
    .sums = sums,
    .moments = moments,
    .normalise = normalise,
    .gradient_sums = gradient_sums,
    .gradient = gradient,
};
