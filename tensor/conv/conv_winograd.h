/* Internal to tensor/conv/conv_winograd*.c: which pixels the tiles of F(4 x 4, 3 x 3) and F(2 x 2, 5 x 5) read and
 * make. */
#ifndef TS_CONV_WINOGRAD_H
#define TS_CONV_WINOGRAD_H
#include "tensor/conv/plan.h"

enum {
    WINOGRAD_REACH = 6, /* the side of a tile's inputs, */
    WINOGRAD_SIDE = 4,  /* and of its outputs at most */
    WINOGRAD_OUTPUTS = WINOGRAD_SIDE * WINOGRAD_SIDE,
    WINOGRAD_AREA = WINOGRAD_REACH * WINOGRAD_REACH,
    WINOGRAD_CHUNK_TILES = 128 /* of a weight gradient's sum: clearing and adding it is little beside making it */
};

/* Outputs [0, out_h) x [0, out_w); tap 0 of output 0 reads row first_row and column first_column. Dilation 2 is four
 * interleaved images. */
typedef struct winograd_grid {
    int n, h, w, ic; /* input */
    int out_h, out_w, oc;
    int dilation, first_row, first_column;
    bool replicate;
    int side;          /* of a tile's outputs: WINOGRAD_REACH + 1 - the kernel's */
    int rows, columns; /* tiles of one interleaved image */
    int64_t tiles;     /* of all */
    bool bf16;         /* products of bf16, of pairs of channels in place of channels */
    int threads;
} winograd_grid;

/* A part of the input's domain, or of what padding puts around it. */
typedef struct winograd_part {
    int row, column, h, w;
} winograd_part;

/* Of a convolution; of the gradient of its input in a part of the domain. */
winograd_grid winograd_grid_forward(const ts_conv *c, bool bf16);
winograd_grid winograd_grid_gradient(const ts_conv *c, winograd_part part, bool bf16);

typedef struct winograd_place {
    int image, i, j; /* first output pixel; the others are dilation apart */
} winograd_place;
void winograd_locate(const winograd_grid *g, int64_t first, int count,
                     winograd_place *place); /* of tiles first, first + 1, ... */

/* The 6 x 6 pixels of x, of so many channels, that a tile reads; nothing, a pixel of zeros, for those outside. */
void winograd_sources(const winograd_grid *g, const float *x, int channels, const float *nothing, winograd_place at,
                      const float *pixel[WINOGRAD_AREA]);

/* Offsets of a tile's side x side outputs; -1: no such pixel. */
void winograd_targets(const winograd_grid *g, winograd_place at, ptrdiff_t pixel[WINOGRAD_OUTPUTS]);

/* Floats of one of 36 planes: whole lines and an odd number of them, or the planes would meet in a few sets of the
 * first cache. */
static inline ptrdiff_t winograd_plane(int tiles, int channels)
{
    return (((ptrdiff_t)tiles * channels + 15) / 16 | 1) * 16;
}
#endif
