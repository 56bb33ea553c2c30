/* The naive twin of the gated unit: one value at a time, in double. */
#include "tensor/conv/gru.h"
#include <math.h>

static double sigmoid(double x) { return 1 / (1 + exp(-x)); }

/* bias[row] + sum_i weight[row][i] x[i]; x NULL: zeros */
static double gate(const float *weight, const float *bias, int row, int channels, const float *x)
{
    double sum = bias[row];
    for (int i = 0; x && i < channels; i++) sum += (double)weight[(int64_t)row * channels + i] * x[i];
    return sum;
}

void ts_gru_forward_naive(const ts_gru *g, const float *x, const float *old, const float *ih_weight,
                          const float *ih_bias, const float *hh_weight, const float *hh_bias, float *y, float *saved)
{
    const int c = g->c;
    for (int64_t p = 0; p < g->pixels; p++)
        for (int i = 0; i < c; i++) {
            const float *a = x + p * g->ic, *b = old ? old + p * c : NULL;
            const double z = sigmoid(gate(ih_weight, ih_bias, i, g->ic, a) + gate(hh_weight, hh_bias, i, c, b));
            const double r = sigmoid(gate(ih_weight, ih_bias, c + i, g->ic, a) + gate(hh_weight, hh_bias, c + i, c, b));
            const double hidden = gate(hh_weight, hh_bias, 2 * c + i, c, b),
                         n = tanh(gate(ih_weight, ih_bias, 2 * c + i, g->ic, a) + r * hidden);
            y[p * c + i] = (float)((b ? (1 - z) * b[i] : 0) + z * n);
            if (!saved) continue;
            float *s = saved + p * 4 * c + i;
            s[0] = (float)z;
            s[c] = (float)r;
            s[2 * c] = (float)n;
            s[3 * c] = (float)hidden;
        }
}

static void put(float *to, double value, bool add) { *to = (float)(add ? *to + value : value); }

/* Gradient d of one row of a product: to its weights, its bias, and through its weights to the input's gradient. */
static void spread(double d, int row, int channels, const float *weight, const float *x, float *dweight, float *dbias,
                   double *dx)
{
    if (dbias) dbias[row] += (float)d;
    for (int i = 0; i < channels; i++) {
        if (dweight && x) dweight[(int64_t)row * channels + i] += (float)(d * x[i]);
        dx[i] += d * weight[(int64_t)row * channels + i];
    }
}

void ts_gru_backward_naive(const ts_gru *g, const float *x, const float *old, const float *ih_weight,
                           const float *hh_weight, const float *saved, const float *dy, const ts_gru_gradients *to)
{
    enum { CHANNELS_MAX = 1024 };
    const int c = g->c;
    for (int64_t p = 0; p < g->pixels; p++) {
        double dx[CHANNELS_MAX] = {0}, dold[CHANNELS_MAX] = {0};
        const float *a = x + p * g->ic, *b = old ? old + p * c : NULL;
        for (int i = 0; i < c; i++) {
            const float *s = saved + p * 4 * c + i;
            const double z = s[0], r = s[c], n = s[2 * c], d = dy[p * c + i], dn = d * z * (1 - n * n);
            const double dz = d * (n - (b ? b[i] : 0)) * z * (1 - z), dr = dn * s[3 * c] * r * (1 - r);
            spread(dz, i, g->ic, ih_weight, a, to->ih_weight, to->ih_bias, dx);
            spread(dr, c + i, g->ic, ih_weight, a, to->ih_weight, to->ih_bias, dx);
            spread(dn, 2 * c + i, g->ic, ih_weight, a, to->ih_weight, to->ih_bias, dx);
            spread(dz, i, c, hh_weight, b, to->hh_weight, to->hh_bias, dold);
            spread(dr, c + i, c, hh_weight, b, to->hh_weight, to->hh_bias, dold);
            spread(dn * r, 2 * c + i, c, hh_weight, b, to->hh_weight, to->hh_bias, dold);
            dold[i] += d * (1 - z);
        }
        for (int i = 0; to->dold && i < c; i++) put(to->dold + p * c + i, dold[i], to->dold_add);
        for (int i = 0; to->dx && i < g->ic; i++) put(to->dx + p * g->ic + i, dx[i], to->dx_add);
    }
}
