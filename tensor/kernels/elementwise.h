/* Kernels on single values and on pixels of c channels. Where accumulate is true the last pointer is added to, else
 * overwritten. Inputs and outputs may be the same memory but not partly overlap. Activations are inverted from their
 * OUTPUT y. */
#ifndef TS_ELEMENTWISE_H
#define TS_ELEMENTWISE_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stdint.h>

/* Klambauer et al., "Self-Normalizing Neural Networks", NIPS 2017 */
#define TS_SELU_SCALE 1.0507009873554805
#define TS_SELU_ALPHA 1.6732632423543772

struct ts_elementwise_kernels {
    /* y = x > 0 ? x : leak x; dx = y > 0 ? dy : leak dy (0 <= leak: y has x's sign) */
    void (*leaky)(int64_t n, const float *x, float leak, float *y);
    void (*leaky_backward)(int64_t n, const float *y, const float *dy, float leak, float *dx, bool accumulate);
    void (*tanh)(int64_t n, const float *x, float *y);
    void (*tanh_backward)(int64_t n, const float *y, const float *dy, float *dx, bool accumulate); /* dy (1 - y^2) */
    /* y = scale (x > 0 ? x : alpha (e^x - 1)); dx = dy (y > 0 ? scale : y + scale alpha) */
    void (*selu)(int64_t n, const float *x, float *y);
    void (*selu_backward)(int64_t n, const float *y, const float *dy, float *dx, bool accumulate);
    void (*asinh)(int64_t n, float s, const float *x, float *y); /* y = asinh(s x) */
    void (*from_half)(int64_t n, const void *x,
                      float *y); /* y = x, IEEE 754 binary16 at any address, exactly; NaNs stay such */
    /* y[r] += sum of w[r][i] x[i]; w: [rows][n], or the same as from_half takes them: the same bytes */
    void (*add_dots)(int64_t rows, int64_t n, const float *w, const float *x, float *y);
    void (*add_dots_half)(int64_t rows, int64_t n, const void *w, const float *x, float *y);
    void (*add)(int64_t n, const float *a, const float *b, float *y);
    void (*scale)(int64_t n, float s, const float *x, float *y, bool accumulate); /* y (+)= s x */

    /* Pixels of c channels: x, y, dy, dx are [pixels][c], g is [c]. */
    void (*add_leaky)(int64_t pixels, int c, const float *x, const float *g, float leak, float *y); /* leaky(x + g) */
    /* dx (+)= m dy, sum[c] += sum over pixels of m dy, m = y > 0 ? 1 : leak. dx or sum may be NULL. */
    void (*add_leaky_backward)(int64_t pixels, int c, const float *y, const float *dy, float leak, float *dx,
                               bool accumulate, double *sum);
    void (*broadcast)(int64_t pixels, int c, const float *g, float *y, bool accumulate); /* y (+)= g at every pixel */
    /* Part of every pixel: dst[p][0 .. c-1] (+)= src[p][0 .. c-1], the pixels dst_stride and src_stride floats apart.
     */
    void (*copy)(int64_t pixels, int c, const float *src, int64_t src_stride, float *dst, int64_t dst_stride,
                 bool accumulate);

    /* The gates and the new state of tensor/conv/gru.h. ih: [pixels][3c] in chunks z, r, n; hh_stride 3c, or 0 for one
     * hh for all pixels; old [pixels][c] or NULL = 0; saved: [pixels][4c] = z, r, n, hh_n, or NULL. */
    void (*gru)(int64_t pixels, int c, const float *ih, const float *hh, int64_t hh_stride, const float *old, float *y,
                float *saved);
    /* With dm = dy z (1 - n^2): d[pixels][4c] = dm, dy (n - old) z (1 - z), dm hh_n r (1 - r), dm r: the gradients of
     * ih_n, of z's and r's sums, and of hh_n; sum[4c] += d over the pixels; dold[pixels][c] (+)= dy (1 - z). dold and
     * sum may be NULL. */
    void (*gru_backward)(int64_t pixels, int c, const float *saved, const float *old, const float *dy, float *d,
                         float *dold, bool accumulate, double *sum);
};
TS_FAMILY(elementwise)

/* The same in plain C, for tests. */
extern const struct ts_elementwise_kernels ts_elementwise_naive;
#endif
