/* The naive twins of the convolutions: what the fast ones must compute. */
#include "tensor/conv/conv.h"
#include <math.h>
#include <string.h>

/* The input coordinate that tap t of output coordinate i reads; -1 where zero padding has nothing. */
static int source(int i, int t, const ts_conv *c, int size)
{
    int s = i + c->dilation * (t - c->k / 2);
    if (s >= 0 && s < size) return s;
    if (c->pad == TS_PAD_ZERO) return -1;
    return s < 0 ? 0 : size - 1;
}

static int64_t at(const ts_conv *c, int n, int i, int j, int channels)
{
    return (((int64_t)n * c->h + i) * c->w + j) * channels;
}
static int64_t tap(const ts_conv *c, int o, int ch, int ky, int kx)
{
    return (((int64_t)o * c->ic + ch) * c->k + ky) * c->k + kx;
}

/* Of the two neighbours the nearer one; infinity is the neighbour 2^128. */
float ts_bf16_naive(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    const uint32_t low = bits & 0xffff0000, high = low + 0x10000;
    if (isinf(x)) return x;
    float a, b;
    if (isnan(x)) {
        const uint32_t quiet = low | 0x00400000;
        memcpy(&a, &quiet, sizeof a);
        return a;
    }
    memcpy(&a, &low, sizeof a);
    memcpy(&b, &high, sizeof b);
    const double size = fabs((double)x), below = size - fabs((double)a),
                 above = (isinf(b) ? 0x1p128 : fabs((double)b)) - size;
    return below < above || (below == above && !(low >> 16 & 1)) ? a : b;
}

void ts_conv_forward_naive(const ts_conv *c, const ts_conv_inputs *in, const float *weight, float leak, float *y)
{
    const int first = in->constants ? ts_conv_variables(c) : c->ic; /* channels of x */
    for (int n = 0; n < c->n; n++)
        for (int i = 0; i < c->h; i++)
            for (int j = 0; j < c->w; j++)
                for (int o = 0; o < c->oc; o++) {
                    const int64_t to = at(c, n, i, j, c->oc) + o;
                    double sum = (in->bias ? in->bias[o] : 0) + (in->base ? (double)in->base[to] : 0);
                    for (int ky = 0; ky < c->k; ky++)
                        for (int kx = 0; kx < c->k; kx++) {
                            int si = source(i, ky, c, c->h), sj = source(j, kx, c, c->w);
                            if (si < 0 || sj < 0) continue;
                            const float *p = in->x + at(c, n, si, sj, first);
                            for (int ch = 0; ch < first; ch++) sum += (double)p[ch] * weight[tap(c, o, ch, ky, kx)];
                            if (first == c->ic) continue;
                            p = in->constants + at(c, n, si, sj, c->constants);
                            for (int ch = first; ch < c->ic; ch++)
                                sum += (double)p[ch - first] * weight[tap(c, o, ch, ky, kx)];
                        }
                    y[to] = (float)(sum > 0 ? sum : leak * sum);
                }
}

/* Gathers, so that the sum can be in double: dx[s] = sum over the outputs and taps that read s. */
void ts_conv_data_gradient_naive(const ts_conv *c, const float *dy, const float *weight, float *dx, bool accumulate)
{
    const int reach = c->dilation * (c->k / 2), channels = ts_conv_variables(c);
    for (int n = 0; n < c->n; n++)
        for (int i = 0; i < c->h; i++)
            for (int j = 0; j < c->w; j++)
                for (int ch = 0; ch < channels; ch++) {
                    double sum = 0;
                    for (int oi = i > reach ? i - reach : 0; oi < c->h && oi <= i + reach; oi++)
                        for (int oj = j > reach ? j - reach : 0; oj < c->w && oj <= j + reach; oj++)
                            for (int ky = 0; ky < c->k; ky++)
                                for (int kx = 0; kx < c->k; kx++) {
                                    if (source(oi, ky, c, c->h) != i || source(oj, kx, c, c->w) != j) continue;
                                    const float *p = dy + at(c, n, oi, oj, c->oc);
                                    for (int o = 0; o < c->oc; o++) sum += (double)p[o] * weight[tap(c, o, ch, ky, kx)];
                                }
                    float *d = dx + at(c, n, i, j, channels) + ch;
                    *d = (float)(accumulate ? *d + sum : sum);
                }
}

void ts_conv_weight_gradient_naive(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias)
{
    for (int o = 0; o < c->oc; o++) {
        for (int ch = 0; dweight && ch < c->ic; ch++)
            for (int ky = 0; ky < c->k; ky++)
                for (int kx = 0; kx < c->k; kx++) {
                    double sum = 0;
                    for (int n = 0; n < c->n; n++)
                        for (int i = 0; i < c->h; i++)
                            for (int j = 0; j < c->w; j++) {
                                int si = source(i, ky, c, c->h), sj = source(j, kx, c, c->w);
                                if (si < 0 || sj < 0) continue;
                                sum += (double)x[at(c, n, si, sj, c->ic) + ch] * dy[at(c, n, i, j, c->oc) + o];
                            }
                    float *d = dweight + tap(c, o, ch, ky, kx);
                    *d = (float)(*d + sum);
                }
        if (!dbias) continue;
        double sum = 0;
        for (int64_t p = 0; p < (int64_t)c->n * c->h * c->w; p++) sum += dy[p * c->oc + o];
        dbias[o] = (float)(dbias[o] + sum);
    }
}
