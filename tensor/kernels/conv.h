/* The inner loops of convolutions and matrix products.
 *
 * tile: y[p][o] = act(init[o] + sum_k a[p][k] w[k][o]) for a few pixels p and one panel of output channels o. The sum
 * over k is a list of segments: runs of k that are contiguous in the input of each pixel. tile_bf16: the same where
 * each float of a and w holds a pair of bf16 values of neighbouring k, the even one in the low half, and a product is
 * the sum of two: made from the halves as floats, or by vdpbf16ps, which takes denormals for zeros. Sums are f32;
 * segments count pairs. sum: c[m][o] += sum_p a[p][m] b[p][o] for a block of m and o over many pixels p: the gradient
 * of weights. sum_bf16: the same where each float of a and b holds the bf16 values of a pair of pixels. */
#ifndef TS_KERNELS_CONV_H
#define TS_KERNELS_CONV_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    TS_TILE_GROUP = 5, /* pixel p of a tile lies at a[p / 5] + (p % 5) stride: no more than four multiples of the stride
                          are needed */
    TS_TILE_PIXELS = 14,
    TS_SUM_ROWS = 14
};

typedef struct ts_segment {
    ptrdiff_t a; /* offset from a tile's pixel, in floats */
    ptrdiff_t w; /* first row of the panel */
    ptrdiff_t count;
} ts_segment;

typedef struct ts_tile {
    const ts_segment *segment;
    int segments;
    ptrdiff_t a_stride, y_stride; /* from pixel to pixel, in floats */
    const float *w;               /* panel: [k][vectors * lanes] */
    const float *bias;            /* of the panel's first channel, or NULL: init = 0 */
    bool add;                     /* init = what y holds */
    float leak;                   /* 0 .. 1; 1: no activation */
    int channels;                 /* of the panel that exist; no others are written */
    const float *a[3];            /* pixels 0, 5, 10 */
    float *y[3];
    const float *fetch[2]; /* prefetched while the sum runs, two lines of each for 4 k; never read, should be mapped */
    ptrdiff_t fetch_step[2]; /* bytes forward for 4 k */
} ts_tile;

typedef struct ts_sum {
    const float *a, *b;
    const ptrdiff_t *a_row, *b_row; /* offsets of runs of count pixels */
    int rows, count;
    ptrdiff_t a_stride, b_stride; /* from pixel to pixel */
    float *c;
    ptrdiff_t c_stride;
    bool begin;           /* c's sums begin with these: it holds nothing yet */
    const char *fetch;    /* prefetched into the second cache, two lines for every other pixel (not by sum_near); never
                             read, but should be mapped */
    ptrdiff_t fetch_step; /* bytes forward for two pixels */
} ts_sum;

typedef void ts_tile_function(const ts_tile *t);
typedef void ts_sum_function(const ts_sum *t);

struct ts_conv_kernels {
    int lanes;                                     /* floats in a vector */
    int pixels;                                    /* largest tile */
    int rows;                                      /* largest m of a sum */
    ts_tile_function *tile[2][TS_TILE_PIXELS + 1]; /* [vectors - 1][pixels] */
    ts_tile_function *tile_bf16[2][TS_TILE_PIXELS + 1];
    ts_sum_function *sum[2][TS_SUM_ROWS + 1];      /* [vectors - 1][m] */
    ts_sum_function *sum_near[2][TS_SUM_ROWS + 1]; /* of what lies in the first cache: nothing is fetched ahead */
    ts_sum_function *sum_bf16[2][TS_SUM_ROWS + 1]; /* sum_near of pairs of pixels */
    void (*columns)(const float *x, int64_t pixels, int channels, float *sum); /* sum[o] += sum_p x[p][o] */
    void (*panel)(const float *x, ptrdiff_t stride, int64_t pixels, int channels,
                  float *to); /* [pixel][lane] of one or two vectors, zeros where there is no channel */
    /* to[c plane + p] = x[p stride + c] */
    void (*transpose)(const float *x, ptrdiff_t stride, int pixels, int channels, float *to, ptrdiff_t plane);
    /* y[p stride + c] = act(x[c plane + p] (+ y[p stride + c])) */
    void (*collect)(const float *x, ptrdiff_t plane, int pixels, int channels, bool add, float leak, float *y,
                    ptrdiff_t stride);
    /* to[p][i] += sum_t x[p step + t next + i], i < vectors * lanes */
    void (*gather)(const float *x, ptrdiff_t step, int taps, ptrdiff_t next, int pixels, int vectors, float *to);
    /* y[p][c] = act(x[p][c] (+ y[p][c])); x has whole vectors of channels a pixel, and is written over */
    void (*finish)(float *x, int64_t pixels, int channels, bool add, float leak, float *y);
};
TS_FAMILY(conv)
#endif
