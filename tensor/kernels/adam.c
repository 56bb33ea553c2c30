#include "tensor/kernels/adam.h"
#include "tensor/kernels/vec.h"

static void step(size_t n, float *p, const float *g, float *m, float *v, float beta1, float beta2, float rate_corrected,
                 float epsilon_corrected, float grad_scale)
{
    const float rest1 = 1.0f - beta1, rest2 = 1.0f - beta2;
    for (size_t i = 0; i < n; i += VL) {
        const size_t left = n - i;
        vf d = v_load_part(g + i, left) * grad_scale;
        vf a = v_load_part(m + i, left) * beta1 + d * rest1;
        vf b = v_load_part(v + i, left) * beta2 + d * d * rest2;
        v_store_part(m + i, a, left);
        v_store_part(v + i, b, left);
        v_store_part(p + i, v_load_part(p + i, left) - rate_corrected * a / (v_sqrt(b) + epsilon_corrected), left);
    }
}

typedef double vd __attribute__((vector_size(VL * 4))); /* half as many lanes */
typedef float vh __attribute__((vector_size(VL * 2)));

static double sum_of_squares(size_t n, const float *x)
{
    enum { H = VL / 2 };
    vd low = {0}, high = {0};
    size_t i = 0;
    for (; i + VL <= n; i += VL) {
        vh a, b;
        memcpy(&a, x + i, sizeof a);
        memcpy(&b, x + i + H, sizeof b);
        vd da = __builtin_convertvector(a, vd), db = __builtin_convertvector(b, vd);
        low += da * da;
        high += db * db;
    }
    low += high;
    double sum = 0;
    for (int j = 0; j < H; j++) sum += low[j];
    for (; i < n; i++) sum += (double)x[i] * x[i];
    return sum;
}

static void average(size_t n, float *ema, const float *p, float decay)
{
    for (size_t i = 0; i < n; i += VL) {
        vf e = v_load_part(ema + i, n - i);
        v_store_part(ema + i, e + (1.0f - decay) * (v_load_part(p + i, n - i) - e), n - i);
    }
}

const struct ts_adam_kernels TS_TABLE(adam) = {.step = step, .sum_of_squares = sum_of_squares, .average = average};
