/* What a convolution is: its shape, and the names of directions, ways and packings. */
#ifndef TS_CONV_SHAPE_H
#define TS_CONV_SHAPE_H
#include "tensor/compute.h"

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
 * products at once (col2im); pixels, not channels, in the lanes; Winograd's F(4 x 4, 3 x 3) and F(2 x 2, 5 x 5); the
 * matrix unit. */
typedef enum ts_conv_way {
    TS_CONV_DIRECTLY,
    TS_CONV_POINTWISE,
    TS_CONV_BY_BATCH,
    TS_CONV_BY_COL2IM,
    TS_CONV_BY_PIXEL_LANES,
    TS_CONV_BY_WINOGRAD,
    TS_CONV_BY_AMX
} ts_conv_way;

/* Input channels that have a gradient. */
static inline int ts_conv_variables(const ts_conv *c) { return c->ic - c->constants; }
#endif
