/* The shapes that the tests of convolutions draw. */
#ifndef TESTS_CONV_SHAPES_H
#define TESTS_CONV_SHAPES_H
#include "tensor/conv/conv.h"
#include "tensor/rng.h"

/* Of at most so many multiplications: the naive twin decides how long a test takes. */
static inline ts_conv any_conv(ts_rng *r, double most)
{
    static const int channels[] = {1, 2, 3, 9, 16, 18, 20, 31, 32, 33, 48, 64}, sides[] = {1, 3, 3, 5, 5, 7};
    static const int sizes[] = {1, 2, 3, 4, 5, 7, 8, 13, 14, 15, 17, 29};
    ts_conv c = {.ic = channels[ts_rng_int(r, 12)],
                 .oc = channels[ts_rng_int(r, 12)],
                 .k = sides[ts_rng_int(r, 6)],
                 .dilation = 1 + ts_rng_int(r, 2),
                 .pad = ts_rng_int(r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE};
    c.h = sizes[ts_rng_int(r, 12)];
    c.w = sizes[ts_rng_int(r, 12)];
    c.n = 1 + ts_rng_int(r, 6);
    while ((double)c.n * c.h * c.w * c.ic * c.oc * c.k * c.k > most) {
        if (c.n > 1 && c.h * c.w > 64) c.n--;
        else if (c.h > c.w && c.h > 4) c.h = c.h / 2;
        else if (c.w > 4) c.w = c.w / 2;
        else if (c.ic > c.oc) c.ic = c.ic / 2 + 1;
        else c.oc = c.oc / 2 + 1;
    }
    return c;
}
#endif
