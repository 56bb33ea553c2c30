/* The naive twin of tensor/kernels/elementwise.c: plain loops, arithmetic in double. */
#include "tensor/kernels/elementwise.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

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
    for (int64_t i = 0; i < n; i++)
        put(dx + i, dy[i] * (y[i] > 0 ? TS_SELU_SCALE : y[i] + TS_SELU_SCALE * TS_SELU_ALPHA), accumulate);
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

static void add_leaky_backward(int64_t pixels, int c, const float *y, const float *dy, float leak, float *dx,
                               bool accumulate, double *sum)
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

static void copy(int64_t pixels, int c, const float *src, int64_t src_stride, float *dst, int64_t dst_stride,
                 bool accumulate)
{
    for (int64_t p = 0; p < pixels; p++)
        for (int i = 0; i < c; i++) put(dst + p * dst_stride + i, src[p * src_stride + i], accumulate);
}

static void gru(int64_t pixels, int c, const float *ih, const float *hh, int64_t hh_stride, const float *old, float *y,
                float *saved)
{
    for (int64_t p = 0; p < pixels; p++) {
        const float *a = ih + p * 3 * c, *b = hh + p * hh_stride;
        for (int i = 0; i < c; i++) {
            double z = sigmoid((double)a[i] + b[i]), r = sigmoid((double)a[c + i] + b[c + i]);
            double n = tanh(a[2 * c + i] + r * b[2 * c + i]);
            if (saved) {
                const double all[4] = {z, r, n, b[2 * c + i]};
                for (int k = 0; k < 4; k++) saved[(p * 4 + k) * c + i] = (float)all[k];
            }
            y[p * c + i] = (float)((old ? (1 - z) * old[p * c + i] : 0) + z * n);
        }
    }
}

static void gru_backward(int64_t pixels, int c, const float *saved, const float *old, const float *dy, float *d,
                         float *dold, bool accumulate, double *sum)
{
    for (int64_t p = 0; p < pixels; p++) {
        for (int i = 0; i < c; i++) {
            const float *s = saved + p * 4 * c + i;
            const double z = s[0], r = s[c], n = s[2 * c], v = dy[p * c + i], m = v * z * (1 - n * n);
            const double all[4] = {m, v * (n - (old ? old[p * c + i] : 0)) * z * (1 - z), m * s[3 * c] * r * (1 - r),
                                   m * r};
            for (int k = 0; k < 4; k++) {
                d[(p * 4 + k) * c + i] = (float)all[k];
                if (sum) sum[k * c + i] += all[k];
            }
            if (dold) put(dold + p * c + i, v * (1 - z), accumulate);
        }
    }
}

static void from_half(int64_t n, const void *x, float *y)
{
    for (int64_t i = 0; i < n; i++) {
        uint16_t h;
        memcpy(&h, (const char *)x + sizeof h * (size_t)i, sizeof h);
        const int exponent = h >> 10 & 31, fraction = h & 0x3ff;
        const double size = exponent == 31 ? fraction ? NAN : INFINITY
            : exponent                     ? ldexp(1024 + fraction, exponent - 25)
                                           : ldexp(fraction, -24);
        y[i] = (float)copysign(size, h & 0x8000 ? -1 : 1);
    }
}

static void add_dots(int64_t rows, int64_t n, const float *w, const float *x, float *y)
{
    for (int64_t r = 0; r < rows; r++) {
        double sum = y[r];
        for (int64_t i = 0; i < n; i++) sum += (double)w[r * n + i] * x[i];
        y[r] = (float)sum;
    }
}

static void add_dots_half(int64_t rows, int64_t n, const void *w, const float *x, float *y)
{
    for (int64_t r = 0; r < rows; r++) {
        double sum = y[r];
        for (int64_t i = 0; i < n; i++) {
            float v;
            from_half(1, (const char *)w + 2 * (r * n + i), &v);
            sum += (double)v * x[i];
        }
        y[r] = (float)sum;
    }
}

const struct ts_elementwise_kernels ts_elementwise_naive = {
    .leaky = leaky,
    .leaky_backward = leaky_backward,
    .tanh = tanh_forward,
    .tanh_backward = tanh_backward,
    .selu = selu,
    .selu_backward = selu_backward,
    .asinh = asinh_scaled,
    .from_half = from_half,
    .add_dots = add_dots,
    .add_dots_half = add_dots_half,
    .add = add,
    .scale = scale,
    .add_leaky = add_leaky,
    .add_leaky_backward = add_leaky_backward,
    .broadcast = broadcast,
    .copy = copy,
    .gru = gru,
    .gru_backward = gru_backward,
};
