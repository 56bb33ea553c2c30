/* The naive twin of tensor/kernels/resample.c: plain loops, sums in double. */
#include "tensor/kernels/resample.h"

static void rows(int64_t n, int count, const float *weight, const float *x, int64_t stride, float *y)
{
    for (int64_t i = 0; i < n; i++) {
        double s = 0;
        for (int k = 0; k < count; k++) s += (double)weight[k] * x[k * stride + i];
        y[i] = (float)s;
    }
}

static void pixels(int w, int c, const int *first, const int *offset, const float *weight, const float *x, float *y,
                   bool accumulate)
{
    for (int j = 0; j < w; j++)
        for (int i = 0; i < c; i++) {
            double s = accumulate ? y[j * c + i] : 0;
            for (int k = offset[j]; k < offset[j + 1]; k++)
                s += (double)weight[k] * x[(first[j] + k - offset[j]) * c + i];
            y[j * c + i] = (float)s;
        }
}

const struct ts_resample_kernels ts_resample_naive = {.rows = rows, .pixels = pixels};
