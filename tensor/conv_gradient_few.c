/* The weight gradient of small images. A unit is a panel of outputs and a block of inputs, with all taps, over all pixels; nobody
 * else touches its sums. Runs of pixels are the images at a pair of positions, so that padding is never multiplied. */
#include "tensor/conv_plan.h"
#include "tensor/threads.h"
#include <string.h>

enum {
    POSITIONS = 64,
    PASS_PIXELS = 128 /* a pass of one panel of dy stays in the first cache */
};

typedef struct staged {
    const float *x;  /* [position][image][channel] */
    const float *dy; /* [panel][position][image][lane] */
    ptrdiff_t pixel; /* floats per pixel of x */
} staged;

static staged stage(const ts_conv *c, const float *x, const float *dy)
{
    const int lanes = conv_lanes(), positions = c->h * c->w, panels = conv_panels(c->oc), padded = (c->oc + lanes - 1) / lanes * lanes;
    const ptrdiff_t pixel = c->ic % 512 ? c->ic : c->ic + 16, pixels = (ptrdiff_t)positions * c->n;
    float *to_x = ts_scratch(0, sizeof(float) * (size_t)(pixels * pixel)), *to_dy = ts_scratch(1, sizeof(float) * (size_t)(pixels * padded));
    for (int q = 0; q < positions; q++)
        for (int n = 0; n < c->n; n++) {
            const ptrdiff_t to = (ptrdiff_t)q * c->n + n, from = (ptrdiff_t)n * positions + q;
            memcpy(to_x + to * pixel, x + from * c->ic, sizeof(float) * (size_t)c->ic);
            for (int panel = 0; panel < panels; panel++) {
                const int width = conv_vectors(c->oc, panel) * lanes, o0 = panel * 2 * lanes, count = c->oc - o0 < width ? c->oc - o0 : width;
                float *d = to_dy + pixels * o0 + to * width;
                memcpy(d, dy + from * c->oc + o0, sizeof(float) * (size_t)count);
                for (int o = count; o < width; o++) d[o] = 0;
            }
        }
    return (staged){to_x, to_dy, pixel};
}

/* The pairs of positions that a tap joins, as rows of a sum. */
static int join(const ts_conv *c, const staged *s, int tap, int width, ptrdiff_t *x_row, ptrdiff_t *dy_row)
{
    const int first = -c->dilation * (c->k / 2);
    int rows = 0;
    for (int q = 0; q < c->h * c->w; q++) {
        int i = q / c->w + first + tap / c->k * c->dilation, j = q % c->w + first + tap % c->k * c->dilation;
        if (c->pad == TS_PAD_REPLICATE) {
            i = conv_clamp(i, c->h);
            j = conv_clamp(j, c->w);
        } else if (i < 0 || i >= c->h || j < 0 || j >= c->w) continue;
        x_row[rows] = ((ptrdiff_t)i * c->w + j) * c->n * s->pixel;
        dy_row[rows++] = (ptrdiff_t)q * c->n * width;
    }
    return rows;
}

void conv_weight_positions(const ts_conv *c, const float *x, const float *dy, float *dweight)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int lanes2 = 2 * kernels->lanes, panels = conv_panels(c->oc), taps = c->k * c->k, rows_pass = c->n < PASS_PIXELS ? PASS_PIXELS / c->n : 1;
    const int blocks = (c->ic + kernels->rows - 1) / kernels->rows;
    const ptrdiff_t pixels = (ptrdiff_t)c->h * c->w * c->n;
#pragma omp parallel num_threads(ts_threads())
    {
        const staged s = stage(c, x, dy);
        float *sums = ts_scratch(2, sizeof(float) * (size_t)(taps * kernels->rows * lanes2)); /* [tap][input][lane] */
#pragma omp for collapse(2) schedule(dynamic)
        for (int panel = 0; panel < panels; panel++)
            for (int block = 0; block < blocks; block++) {
                const int vectors = conv_vectors(c->oc, panel), width = vectors * kernels->lanes, o0 = panel * lanes2;
                const int count = c->oc - o0 < width ? c->oc - o0 : width;
                int begin, end;
                conv_part(c->ic, blocks, block, &begin, &end);
                memset(sums, 0, sizeof(float) * (size_t)(taps * (end - begin) * lanes2));
                for (int tap = 0; tap < taps; tap++) {
                    ptrdiff_t x_row[POSITIONS], dy_row[POSITIONS];
                    const int rows = join(c, &s, tap, width, x_row, dy_row);
                    for (int r = 0; r < rows; r += rows_pass) {
                        const ts_sum t = {.a = s.x + begin, .b = s.dy + pixels * o0, .a_row = x_row + r, .b_row = dy_row + r,
                                          .rows = rows - r < rows_pass ? rows - r : rows_pass, .count = c->n, .a_stride = s.pixel, .b_stride = width,
                                          .c = sums + (ptrdiff_t)tap * (end - begin) * lanes2, .c_stride = lanes2, .fetch = (const char *)sums};
                        kernels->sum[vectors - 1][end - begin](&t);
                    }
                }
                for (int o = 0; o < count; o++) {
                    float *to = dweight + ((ptrdiff_t)(o0 + o) * c->ic + begin) * taps;
                    for (int i = 0; i < end - begin; i++)
                        for (int tap = 0; tap < taps; tap++) to[i * taps + tap] += sums[((ptrdiff_t)tap * (end - begin) + i) * lanes2 + o];
                }
            }
    }
}
