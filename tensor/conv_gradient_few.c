/* The weight gradient of small images. A unit is a panel of outputs and a block of inputs, with all taps, over all pixels; nobody
 * else touches its sums. Runs of pixels are the images at a pair of positions, so that padding is never multiplied. */
#include "tensor/conv_plan.h"
#include "tensor/threads.h"
#include <string.h>

enum {
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

/* The pairs of positions that a tap joins, as rows of *count pixels of a sum: neighbours stay neighbours unless they are replicated. */
static int join(const ts_conv *c, const staged *s, int tap, int width, ptrdiff_t *x_row, ptrdiff_t *dy_row, int *count)
{
    const int reach = c->dilation * (c->k / 2), di = tap / c->k * c->dilation - reach, dj = tap % c->k * c->dilation - reach;
    const bool replicate = c->pad == TS_PAD_REPLICATE;
    const int left = replicate || dj > 0 ? 0 : -dj, right = replicate || dj < 0 ? c->w : c->w - dj, run = replicate ? 1 : right - left;
    int rows = 0;
    for (int i = 0; i < c->h && run > 0; i++) {
        const int from = replicate ? conv_clamp(i + di, c->h) : i + di;
        if (from < 0 || from >= c->h) continue;
        for (int j = left; j < right; j += run) {
            x_row[rows] = ((ptrdiff_t)from * c->w + (replicate ? conv_clamp(j + dj, c->w) : j + dj)) * c->n * s->pixel;
            dy_row[rows++] = ((ptrdiff_t)i * c->w + j) * c->n * width;
        }
    }
    *count = run * c->n;
    return rows;
}

void conv_weight_positions(const ts_conv *c, const float *x, const float *dy, float *dweight)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int lanes2 = 2 * kernels->lanes, panels = conv_panels(c->oc), taps = c->k * c->k;
    const int blocks = (c->ic + kernels->rows - 1) / kernels->rows;
    const ptrdiff_t pixels = (ptrdiff_t)c->h * c->w * c->n;
#pragma omp parallel num_threads(ts_threads())
    {
        const staged s = stage(c, x, dy);
        float *sums = ts_scratch(2, sizeof(float) * (size_t)(taps * kernels->rows * lanes2)); /* [input][tap][lane] */
#pragma omp for collapse(2) schedule(dynamic)
        for (int panel = 0; panel < panels; panel++)
            for (int block = 0; block < blocks; block++) {
                const int vectors = conv_vectors(c->oc, panel), width = vectors * kernels->lanes, o0 = panel * lanes2;
                const int count = c->oc - o0 < width ? c->oc - o0 : width;
                int begin, end;
                conv_part(c->ic, blocks, block, &begin, &end);
                memset(sums, 0, sizeof(float) * (size_t)(taps * (end - begin) * lanes2));
                for (int tap = 0; tap < taps; tap++) {
                    ptrdiff_t x_row[CONV_POSITIONS], dy_row[CONV_POSITIONS];
                    int run;
                    const int rows = join(c, &s, tap, width, x_row, dy_row, &run), rows_pass = run < PASS_PIXELS ? PASS_PIXELS / (run > 0 ? run : 1) : 1;
                    for (int r = 0; r < rows; r += rows_pass) {
                        const ts_sum t = {.a = s.x + begin, .b = s.dy + pixels * o0, .a_row = x_row + r, .b_row = dy_row + r,
                                          .rows = rows - r < rows_pass ? rows - r : rows_pass, .count = run, .a_stride = s.pixel, .b_stride = width,
                                          .c = sums + tap * lanes2, .c_stride = (ptrdiff_t)taps * lanes2, .fetch = (const char *)sums};
                        kernels->sum[vectors - 1][end - begin](&t);
                    }
                }
                kernels->collect(sums, lanes2, count, (end - begin) * taps, true, 1, dweight + ((ptrdiff_t)o0 * c->ic + begin) * taps,
                                 (ptrdiff_t)c->ic * taps);
            }
    }
}
