/* The naive twin of tensor/kernels/elementwise.c: plain loops, arithmetic in double. */
#include "tensor/kernels/elementwise.h"
#include <math.h>
#include <stddef.h>

static void put(float *p, double x, bool accumulate) { *p = (float)(accumulate ? *p + x : x); }
static double sigmoid(double x) { return 1 / (1 + exp(-x)); }

static void leaky(int64_t n, const float *x, float leak, float *y)
{
    for (int64_t i = 0; i < n; i++) y[i] = x[i] > 0 ? x[i] : leak * x[i];
}

static void leaky_backward(int64_t n, const float *y, const float *dy, float leak, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < n; i++) put(dx + i, y[i] > 0 ? dy[i] : (double)leak * dy[i], accumulate);
}

static void tanh_forward(int64_t n, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i++) y[i] = (float)tanh(x[i]);
}

static void tanh_backward(int64_t n, const float *y, const float *dy, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < n; i++) put(dx + i, dy[i] * (1 - (double)y[i] * y[i]), accumulate);
}

static void selu(int64_t n, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i++) y[i] = (float)(TS_SELU_SCALE * (x[i] > 0 ? x[i] : TS_SELU_ALPHA * expm1(x[i])));
}

static void selu_backward(int64_t n, const float *y, const float *dy, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < n; i++) put(dx + i, dy[i] * (y[i] > 0 ? TS_SELU_SCALE : y[i] + TS_SELU_SCALE * TS_SELU_ALPHA), accumulate);
}

static void asinh_scaled(int64_t n, float s, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i++) y[i] = (float)asinh((double)s * x[i]);
}

static void add(int64_t n, const float *a, const float *b, float *y)
{
    for (int64_t i = 0; i < n; i++) y[i] = a[i] + b[i];
}

static void scale(int64_t n, float s, const float *x, float *y, bool accumulate)
{
    for (int64_t i = 0; i < n; i++) put(y + i, (double)s * x[i], accumulate);
}

static void add_leaky(int64_t pixels, int c, const float *x, const float *g, float leak, float *y)
{
    for (int64_t i = 0; i < pixels * c; i++) {
        float v = x[i] + g[i % c];
        y[i] = v > 0 ? v : leak * v;
    }
}

static void add_leaky_backward(int64_t pixels, int c, const float *y, const float *dy, float leak, float *dx, bool accumulate, double *sum)
{
    for (int64_t i = 0; i < pixels * c; i++) {
        double d = y[i] > 0 ? dy[i] : (double)leak * dy[i];
        if (sum) sum[i % c] += d;
        if (dx) put(dx + i, d, accumulate);
    }
}

static void broadcast(int64_t pixels, int c, const float *g, float *y, bool accumulate)
{
    for (int64_t i = 0; i < pixels * c; i++) put(y + i, g[i % c], accumulate);
}

static void copy(int64_t pixels, int c, const float *src, int64_t src_stride, float *dst, int64_t dst_stride, bool accumulate)
{
    for (int64_t p = 0; p < pixels; p++)
        for (int i = 0; i < c; i++) put(dst + p * dst_stride + i, src[p * src_stride + i], accumulate);
}

static void gru(int64_t pixels, int c, const float *ih, const float *hh, int64_t hh_stride, const float *old, float *y, float *zrn)
{
    for (int64_t p = 0; p < pixels; p++) {
        const float *a = ih + p * 3 * c, *b = hh + p * hh_stride;
        for (int i = 0; i < c; i++) {
            double z = sigmoid((double)a[i] + b[i]), r = sigmoid((double)a[c + i] + b[c + i]);
            double n = tanh(a[2 * c + i] + r * b[2 * c + i]);
            if (zrn) {
                zrn[p * 3 * c + i] = (float)z;
                zrn[p * 3 * c + c + i] = (float)r;
                zrn[p * 3 * c + 2 * c + i] = (float)n;
            }
            y[p * c + i] = (float)((old ? (1 - z) * old[p * c + i] : 0) + z * n);
        }
    }
}

static void gru_backward(int64_t pixels, int c, const float *hh, int64_t hh_stride, const float *old, const float *zrn, const float *dy,
                         float *dih, bool dih_accumulate, float *dhh, bool dhh_accumulate, float *dold, bool dold_accumulate, double *sum)
{
    for (int64_t p = 0; p < pixels; p++) {
        for (int i = 0; i < c; i++) {
            const int64_t at = p * 3 * c + i;
            double z = zrn[at], r = zrn[at + c], n = zrn[at + 2 * c], d = dy[p * c + i];
            double before[3] = {0}, hidden[3];
            before[0] = d * (n - (old ? old[p * c + i] : 0)) * z * (1 - z);
            before[2] = d * z * (1 - n * n);
            before[1] = before[2] * hh[p * hh_stride + 2 * c + i] * r * (1 - r);
            hidden[0] = before[0];
            hidden[1] = before[1];
            hidden[2] = before[2] * r;
            for (int k = 0; k < 3; k++) {
                if (dih) put(dih + at + k * c, before[k], dih_accumulate);
                if (dhh) put(dhh + at + k * c, hidden[k], dhh_accumulate);
                if (sum) sum[k * c + i] += hidden[k];
            }
            if (dold) put(dold + p * c + i, d * (1 - z), dold_accumulate);
        }
    }
}

const struct ts_elementwise_kernels ts_elementwise_naive = {
    .leaky = leaky, .leaky_backward = leaky_backward, .tanh = tanh_forward, .tanh_backward = tanh_backward, .selu = selu,
    .selu_backward = selu_backward, .asinh = asinh_scaled, .add = add, .scale = scale, .add_leaky = add_leaky, .add_leaky_backward = add_leaky_backward,
    .broadcast = broadcast, .copy = copy, .gru = gru, .gru_backward = gru_backward,
};
