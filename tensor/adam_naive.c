/* The naive twin of tensor/kernels/adam.c: plain loops, arithmetic in double. */
#include "tensor/kernels/adam.h"
#include <math.h>

static void step(size_t n, float *p, const float *g, float *m, float *v, float beta1, float beta2, float rate_corrected,
                 float epsilon_corrected, float grad_scale)
{
    for (size_t i = 0; i < n; i++) {
        double d = (double)g[i] * grad_scale;
        double a = (double)beta1 * m[i] + (1 - (double)beta1) * d;
        double b = (double)beta2 * v[i] + (1 - (double)beta2) * d * d;
        m[i] = (float)a;
        v[i] = (float)b;
        p[i] = (float)(p[i] - rate_corrected * a / (sqrt(b) + epsilon_corrected));
    }
}

static double sum_of_squares(size_t n, const float *x)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += (double)x[i] * x[i];
    return sum;
}

static void average(size_t n, float *ema, const float *p, float decay)
{
    for (size_t i = 0; i < n; i++) ema[i] = (float)(ema[i] + (1 - (double)decay) * ((double)p[i] - ema[i]));
}

const struct ts_adam_kernels ts_adam_naive = {.step = step, .sum_of_squares = sum_of_squares, .average = average};
