/* The transforms of Winograd's convolution F(4 x 4, 3 x 3) on vectors of channels (Lavin and Gray, Fast Algorithms for
 * Convolutional Neural Networks, 2016, section 4.3). The products between them are those of tensor/kernels/conv.h. */
#ifndef TS_KERNELS_WINOGRAD_H
#define TS_KERNELS_WINOGRAD_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stddef.h>

struct ts_winograd_kernels {
    /* v[36 planes][c] = (B' d B)[c] of 6 x 6 pixels, pixel[6 i + j] -> channels floats. next: the pixels of the next
     * tile, to be fetched. */
    void (*input)(const float *const pixel[36], const float *const next[36], int channels, float *v, ptrdiff_t plane);
    /* y[4 i + j][c] = act(bias[c] + (A' m A)[c] (+ y[4 i + j][c])) where y is not NULL; bias may be NULL; 0 <= leak <=
     * 1 as in tensor/conv/conv.h. next: the next tile's y, to be fetched */
    void (*output)(const float *m, ptrdiff_t plane, int channels, const float *bias, float leak, bool add,
                   float *const y[16], float *const next[16]);
    /* u[36 planes][o] = (G g G')[o] of tap[3 i + j][o], o over whole vectors. */
    void (*weights)(const float *tap, int vectors, float *u, ptrdiff_t plane);
    /* What output and weights do, transposed. m[36 planes][c] = (A dy A')[c], its last vector whole, with zeros behind
     * the channels; */
    void (*output_gradient)(const float *const dy[16], const float *const next[16], int channels, float *m,
                            ptrdiff_t plane);
    /* tap[3 i + j][o] = (G' u G)[o] of one vector of o, u being the sum of so many, sum floats apart, in order. */
    void (*weights_gradient)(const float *u, ptrdiff_t plane, int sums, ptrdiff_t sum, float *tap);
};
TS_FAMILY(winograd)
#endif
