/* 2-D convolution on [N, H, W, C] images: stride 1, odd square kernels, dilation 1 or 2, same-size output, and its
 * gradients. Threads share fixed chunks: the same bytes for any number of threads. Weights are [OC, IC, K,
 * K] in files and in parameter blocks and are packed for the kernels by ts_conv_pack. Every function trusts its shape
 * (validated by ts_conv_check). */
#ifndef TS_CONV_H
#define TS_CONV_H
#include "tensor/conv/conv_choose.h"
#include "tensor/tensor.h"

ts_code ts_conv_check(const ts_conv *c, ts_status *st);

/* floats; does not depend on n, h, w. Packed weights are for the ISA in use (tensor/cpu.h). */
size_t ts_conv_packed_count(const ts_conv *c, ts_conv_use use);
void ts_conv_pack(const ts_conv *c, ts_conv_use use, const float *weight /* [oc][ic][k][k] */, float *packed);
/* The same of IEEE 754 halves, in this machine's byte order and aligned to nothing; false: no memory. */
bool ts_conv_pack_half(const ts_conv *c, ts_conv_use use, const void *weight, float *packed);

/* What an output, or a gradient of weights (x and constants alone), is made of. */
typedef struct ts_conv_inputs {
    const float *x;         /* [n,h,w,ic]; without the last channels where these are in constants */
    const float *bias;      /* [oc], or NULL */
    const float *constants; /* [n,h,w,c->constants], or NULL; where ts_conv_joins says so for the direction alone */
    const float *base;      /* [n,h,w,oc], y or not overlapping it, or NULL; where ts_conv_adds says so alone */
} ts_conv_inputs;

/* y[n,i,j,o] = act(bias[o] + base[n,i,j,o] + sum_{ky,kx,c} x[n, i + d(ky-k/2), j + d(kx-k/2), c] weight[o,c,ky,kx]),
 * act(v) = v > 0 ? v : leak v (0 <= leak <= 1; 1: the identity, 0: ReLU). All contiguous, x and constants not
 * overlapping y. */
void ts_conv_forward(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y);

/* The same y, and the gradients below, by Winograd's F(4 x 4, 3 x 3) or F(2 x 2, 5 x 5) with weights packed for the use
 * of that name; c->k must be 3, or 5 (of weights 3). Its products are a quarter of the direct way's (of side 5 .36),
 * its rounding errors about ten times as large (1e-5 of the largest value, not 1e-6). */
void ts_conv_forward_winograd(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y);
void ts_conv_data_gradient_winograd(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);
void ts_conv_weight_gradient_winograd(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight);

/* dx [n,h,w,ts_conv_variables] (+)= the gradient of the input given dy = the gradient before the activation. */
void ts_conv_data_gradient(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);

/* Both with x, dy and the weights rounded to bf16 (the nearest, ties to even), products and sums in f32, weights packed
 * for the use of that name: vdpbf16ps where the CPU has it, the same sum from floats elsewhere. Bias, activation and
 * results are f32. */
void ts_conv_forward_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y);
void ts_conv_data_gradient_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);

/* Both by Winograd's way for c->k = 3 with what it multiplies rounded to bf16, transforms and sums in f32, and the
 * gradient of the weights too. Transforms magnify the rounding of numbers that do not resemble their neighbours': the
 * RMS of errors is 1.1% of the results' RMS, in place of the direct way's 0.24%, where inputs are random, and the same
 * 0.24% where they are as smooth as images (tensor/kernels/winograd.h). */
void ts_conv_forward_winograd_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak,
                                   float *y);
void ts_conv_data_gradient_winograd_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx,
                                         bool accumulate);
void ts_conv_weight_gradient_winograd_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight);

/* dweight[oc][ic][k][k] += with x and dy rounded so. Pairs are of pixels, or of images, not of channels. */
void ts_conv_weight_gradient_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight);

/* dweight[oc][ic][k][k] += , dbias[oc] += (either may be NULL). */
void ts_conv_weight_gradient(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias);

/* Naive twins: loop nests, sums in double; the same arguments with unpacked weights. Those of bf16 are the same on
 * rounded arguments. */
float ts_bf16_naive(float x); /* the bf16 value nearest to x */
void ts_conv_forward_naive(const ts_conv *c, const ts_conv_inputs *in, const float *weight, float leak, float *y);
void ts_conv_data_gradient_naive(const ts_conv *c, const float *dy, const float *weight, float *dx, bool accumulate);
void ts_conv_weight_gradient_naive(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias);
#endif
