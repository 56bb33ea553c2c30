/* The transforms of Winograd's convolutions F(4 x 4, 3 x 3) and F(2 x 2, 5 x 5) on vectors of channels (Lavin and Gray,
 * Fast Algorithms for Convolutional Neural Networks, 2016, section 4.3). Both read 6 x 6 pixels, transformed alike: a
 * kernel of side k makes 7 - k x 7 - k of them. Of side 5 there are products of floats alone: between those of bf16 the
 * errors of random numbers are 2% of the sums' RMS. The products between them are those of tensor/kernels/conv.h. */
#ifndef TS_KERNELS_WINOGRAD_H
#define TS_KERNELS_WINOGRAD_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stddef.h>

/* What the transforms make for the products: floats; or, between products of bf16, pairs of values in place of each
 * float, the even one in the low half, of neighbouring channels, or of the same channel of two tiles or two inputs, of
 * which the even one is to be put first. Rounding costs less where the points at which polynomials are multiplied lie
 * about 1: 0, +-11/16, +-3/2 and infinity in place of 0, +-1, +-2 and infinity, with which errors of random numbers are
 * 1.1% of the sums' RMS and not 2.6 (those of the direct way: 0.24). */
typedef enum ts_winograd_form {
    TS_WINOGRAD_F32,
    TS_WINOGRAD_CHANNELS,
    TS_WINOGRAD_EVEN,
    TS_WINOGRAD_ODD,
    TS_WINOGRAD_FORMS
} ts_winograd_form;

/* [form]: NULL where there is none. */
struct ts_winograd_kernels {
    /* v[36 planes][c] = (B' d B)[c] of 6 x 6 pixels, pixel[6 i + j] -> channels floats. next: the pixels of the next
     * tile, to be fetched. An odd number of channels ends with a pair of one and a zero. */
    void (*input[TS_WINOGRAD_FORMS])(const float *const pixel[36], const float *const next[36], int channels, float *v,
                                     ptrdiff_t plane);
    /* y[at[(7 - k) i + j] + c] = act(bias[c] + base[at[..] + c] + (A' m A)[c]) where that at is not negative; bias and
     * base may be NULL, base may be y; 0 <= leak <= 1 as in tensor/conv/conv.h. next: where the next tile's go, to be
     * fetched. [k = 3, 5][whether products are of bf16] */
    void (*output[2][2])(const float *m, ptrdiff_t plane, int channels, const float *bias, const float *base,
                         float leak, float *y, const ptrdiff_t *at, const ptrdiff_t *next);
    /* u[36 planes][o] = (G g G')[o] of tap[(k i + j) step + o], o over whole vectors. [k = 3, 5] */
    void (*weights[2][TS_WINOGRAD_FORMS])(const float *tap, ptrdiff_t step, int vectors, float *u, ptrdiff_t plane);
    /* What output and weights do where k = 3, transposed. m[36 planes][c] = (A dy A')[c], its last vector whole, with
     * zeros behind the channels; */
    void (*output_gradient[TS_WINOGRAD_FORMS])(const float *const dy[16], const float *const next[16], int channels,
                                               float *m, ptrdiff_t plane);
    /* tap[3 i + j][o] = (G' u G)[o] of one vector of o, u being the sum of so many, sum floats apart, in order.
     * [whether products are of bf16] */
    void (*weights_gradient[2])(const float *u, ptrdiff_t plane, int sums, ptrdiff_t sum, float *tap);
};
TS_FAMILY(winograd)
#endif
