/* 2-D convolution on [N, H, W, C] images: stride 1, odd square kernels, dilation 1 or 2, same-size output, and its
 * gradients. Threads share fixed chunks: the same bytes for any number of threads. Weights are [OC, IC, K,
 * K] in files and in parameter blocks and are packed for the kernels by ts_conv_pack. Every function trusts its shape
 * (validated by ts_conv_check). */
#ifndef TS_CONV_H
#define TS_CONV_H
#include "tensor/compute.h"
#include "tensor/tensor.h"

typedef enum ts_pad { TS_PAD_ZERO, TS_PAD_REPLICATE } ts_pad;

typedef struct ts_conv {
    int n, h, w;   /* images, rows, columns of input and output */
    int ic, oc;    /* input and output channels */
    int k;         /* kernel side: odd, 1 .. 15 */
    int dilation;  /* 1 or 2 */
    ts_pad pad;    /* padding of dilation * (k - 1) / 2 on each side */
    int constants; /* of the input's channels, the last: the data gradient is that of the others alone */
    ts_compute compute;
} ts_conv;

/* Which order the packed weights are in: for the output and for the gradient of the input; both by Winograd's way; both
 * as pairs of bf16 values; both. */
typedef enum ts_conv_use {
    TS_CONV_FORWARD,
    TS_CONV_DATA_GRADIENT,
    TS_CONV_WINOGRAD,
    TS_CONV_DATA_GRADIENT_WINOGRAD,
    TS_CONV_FORWARD_BF16,
    TS_CONV_DATA_GRADIENT_BF16,
    TS_CONV_WINOGRAD_BF16,
    TS_CONV_DATA_GRADIENT_WINOGRAD_BF16,
    TS_CONV_USES
} ts_conv_use;

typedef enum ts_conv_direction { TS_CONV_OUTPUT, TS_CONV_INPUT, TS_CONV_WEIGHTS } ts_conv_direction;

/* How: by rows of a padded window; without one where k = 1; position by position of several small maps; all taps'
 * products at once (col2im); pixels, not channels, in the lanes; Winograd's F(4 x 4, 3 x 3); the matrix unit. */
typedef enum ts_conv_way {
    TS_CONV_DIRECTLY,
    TS_CONV_BY_PIXELS,
    TS_CONV_BY_BATCH,
    TS_CONV_BY_COL2IM,
    TS_CONV_BY_LANES,
    TS_CONV_BY_WINOGRAD,
    TS_CONV_BY_AMX
} ts_conv_way;
/* Of the output, or of a gradient, by shape, c->compute and the ISA in use (conv_choose.c says why). */
ts_conv_way ts_conv_choose(const ts_conv *c, ts_conv_direction direction);
/* What its weights are packed for; not for TS_CONV_WEIGHTS. */
ts_conv_use ts_conv_packing(const ts_conv *c, ts_conv_direction direction);
/* Whether gradients of weights are made of rounded values: of those of c->compute, where that costs no time. */
bool ts_conv_rounds_weights(const ts_conv *c);
const char *ts_conv_way_name(ts_conv_way way);

static inline int ts_conv_variables(const ts_conv *c) { return c->ic - c->constants; }

ts_code ts_conv_check(const ts_conv *c, ts_status *st);

/* floats; does not depend on n, h, w. Packed weights are for the ISA in use (tensor/cpu.h). */
size_t ts_conv_packed_count(const ts_conv *c, ts_conv_use use);
void ts_conv_pack(const ts_conv *c, ts_conv_use use, const float *weight /* [oc][ic][k][k] */, float *packed);
/* The same of IEEE 754 halves, in this machine's byte order and aligned to nothing; false: no memory. */
bool ts_conv_pack_half(const ts_conv *c, ts_conv_use use, const void *weight, float *packed);

/* y[n,i,j,o] = act(bias[o] + sum_{ky,kx,c} x[n, i + d(ky-k/2), j + d(kx-k/2), c] weight[o,c,ky,kx]),
 * act(v) = v > 0 ? v : leak v (0 <= leak <= 1; 1: the identity, 0: ReLU). bias may be NULL. x and y contiguous, not
 * overlapping. */
void ts_conv_forward(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak, float *y);

/* The same y, and the gradients below, by Winograd's F(4 x 4, 3 x 3) with weights packed for the use of that name; c->k
 * must be 3. Its products are a quarter of the direct way's, its rounding errors about ten times as large (1e-5 of the
 * largest value, not 1e-6). */
void ts_conv_forward_winograd(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak,
                              float *y);
void ts_conv_data_gradient_winograd(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);
void ts_conv_weight_gradient_winograd(const ts_conv *c, const float *x, const float *dy, float *dweight);

/* dx [n,h,w,ts_conv_variables] (+)= the gradient of the input given dy = the gradient before the activation. */
void ts_conv_data_gradient(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);

/* Both with x, dy and the weights rounded to bf16 (the nearest, ties to even), products and sums in f32, weights packed
 * for the use of that name: vdpbf16ps where the CPU has it, the same sum from floats elsewhere. Bias, activation and
 * results are f32. */
void ts_conv_forward_bf16(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak,
                          float *y);
void ts_conv_data_gradient_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);

/* Both by Winograd's way with what it multiplies rounded to bf16, transforms and sums in f32, and the gradient of the
 * weights too. Transforms magnify the rounding of numbers that do not resemble their neighbours': the RMS of errors is
 * 1.1% of the results' RMS, in place of the direct way's 0.24%, where inputs are random, and the same 0.24% where they
 * are as smooth as images (tensor/kernels/winograd.h). */
void ts_conv_forward_winograd_bf16(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak,
                                   float *y);
void ts_conv_data_gradient_winograd_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx,
                                         bool accumulate);
void ts_conv_weight_gradient_winograd_bf16(const ts_conv *c, const float *x, const float *dy, float *dweight);

/* dweight[oc][ic][k][k] += with x and dy rounded so. Pairs are of pixels, or of images, not of channels. */
void ts_conv_weight_gradient_bf16(const ts_conv *c, const float *x, const float *dy, float *dweight);

/* dweight[oc][ic][k][k] += , dbias[oc] += (either may be NULL). */
void ts_conv_weight_gradient(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias);

/* Naive twins: loop nests, sums in double; the same arguments with unpacked weights. Those of bf16 are the same on
 * rounded arguments. */
float ts_bf16_naive(float x); /* the bf16 value nearest to x */
void ts_conv_forward_naive(const ts_conv *c, const float *x, const float *weight, const float *bias, float leak,
                           float *y);
void ts_conv_data_gradient_naive(const ts_conv *c, const float *dy, const float *weight, float *dx, bool accumulate);
void ts_conv_weight_gradient_naive(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias);
#endif
