/* The weight gradient of small images. A unit is a panel of outputs and a part of the inputs, with all taps, over all
 * pixels; nobody else touches its sums. Runs of pixels are the images at a pair of positions, so that padding is never
 * multiplied. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/threads.h"
#include <string.h>

enum {
    PASS_PIXELS = 128, /* a pass of one panel of dy stays in the first cache */
    PIECES = 16
};

typedef struct operands {
    const float *x;  /* [position][image][channel] */
    const float *dy; /* [panel][position][image][lane] */
    ptrdiff_t pixel; /* floats per pixel of x */
} operands;

static operands gather(const ts_conv *c, const float *x, const float *dy)
{
    const int lanes = conv_lanes(), positions = c->h * c->w, panels = conv_panels(c->oc),
              padded = (c->oc + lanes - 1) / lanes * lanes;
    const ptrdiff_t pixel = c->ic % 512 ? c->ic : c->ic + 16, pixels = (ptrdiff_t)positions * c->n;
    float *to_x = ts_scratch(0, sizeof(float) * (size_t)(pixels * pixel)),
          *to_dy = ts_scratch(1, sizeof(float) * (size_t)(pixels * padded));
    for (int q = 0; q < positions; q++)
        for (int n = 0; n < c->n; n++) {
            const ptrdiff_t to = (ptrdiff_t)q * c->n + n, from = (ptrdiff_t)n * positions + q;
            memcpy(to_x + to * pixel, x + from * c->ic, sizeof(float) * (size_t)c->ic);
            for (int panel = 0; panel < panels; panel++) {
                const int width = conv_vectors(c->oc, panel) * lanes, o0 = panel * 2 * lanes;
                ts_conv_k()->panel(dy + from * c->oc + o0, 0, 1, c->oc - o0 < width ? c->oc - o0 : width,
                                   to_dy + pixels * o0 + to * width);
            }
        }
    return (operands){to_x, to_dy, pixel};
}

/* The pairs of positions that a tap joins, as rows of count pixels of a sum. */
typedef struct joined {
    int rows, count;
    ptrdiff_t x[CONV_BATCH_PIXELS], dy[CONV_BATCH_PIXELS];
} joined;

/* Neighbours stay neighbours unless they are replicated. */
static void join(const ts_conv *c, const operands *s, int tap, int width, joined *to)
{
    const int reach = c->dilation * (c->k / 2), di = tap / c->k * c->dilation - reach,
              dj = tap % c->k * c->dilation - reach;
    const bool replicate = c->pad == TS_PAD_REPLICATE;
    const int left = replicate || dj > 0 ? 0 : -dj, right = replicate || dj < 0 ? c->w : c->w - dj,
              run = replicate ? 1 : right - left;
    to->rows = 0;
    to->count = run * c->n;
    for (int i = 0; i < c->h && run > 0; i++) {
        const int from = replicate ? conv_clamp(i + di, c->h) : i + di;
        if (from < 0 || from >= c->h) continue;
        for (int j = left; j < right; j += run) {
            to->x[to->rows] = ((ptrdiff_t)from * c->w + (replicate ? conv_clamp(j + dj, c->w) : j + dj)) * c->n *
                s->pixel;
            to->dy[to->rows++] = ((ptrdiff_t)i * c->w + j) * c->n * width;
        }
    }
}

/* The rows [begin, end) of dweight, of which length floats will be added to. */
static void fetch(const float *dweight, ptrdiff_t row, int begin, int end, int length)
{
    for (int o = begin; o < end; o++)
        for (int i = 0; i < length; i += 16) __builtin_prefetch(dweight + o * row + i, 1, 2);
}

void conv_batch_weight_gradient(const ts_conv *c, const float *x, const float *dy, float *dweight)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int lanes2 = 2 * kernels->lanes, panels = conv_panels(c->oc), taps = c->k * c->k;
    const int parts = (c->ic + kernels->rows - 1) / kernels->rows;
    const int piece = (panels * parts + PIECES - 1) / PIECES; /* of neighbouring parts, which share lines of dweight */
    const ptrdiff_t pixels = (ptrdiff_t)c->h * c->w * c->n, row = (ptrdiff_t)c->ic * taps;
#pragma omp parallel num_threads(ts_threads_of(c->compute.threads))
    {
        const operands s = gather(c, x, dy);
        float *sums = ts_scratch(2, sizeof(float) * (size_t)(taps * kernels->rows * lanes2)); /* [input][tap][lane] */
        joined *of = ts_scratch(3, sizeof(joined) * (size_t)taps);
        int joined_width = 0;
#pragma omp for collapse(2) schedule(dynamic, piece)
        for (int panel = 0; panel < panels; panel++)
            for (int part = 0; part < parts; part++) {
                const int vectors = conv_vectors(c->oc, panel), width = vectors * kernels->lanes, o0 = panel * lanes2;
                const int count = c->oc - o0 < width ? c->oc - o0 : width;
                int begin, end;
                conv_part(c->ic, parts, part, &begin, &end);
                float *to = dweight + o0 * row + (ptrdiff_t)begin * taps;
                if (width != joined_width)
                    for (int tap = 0; tap < taps; tap++) join(c, &s, tap, width, &of[tap]);
                joined_width = width;
                memset(sums, 0, sizeof(float) * (size_t)(taps * (end - begin) * lanes2));
                for (int tap = 0; tap < taps; tap++) {
                    const joined *j = &of[tap];
                    const int rows_pass = j->count < PASS_PIXELS ? PASS_PIXELS / (j->count > 0 ? j->count : 1) : 1;
                    fetch(to, row, count * tap / taps, count * (tap + 1) / taps, (end - begin) * taps);
                    for (int r = 0; r < j->rows; r += rows_pass) {
                        const ts_sum t = {.a = s.x + begin,
                                          .b = s.dy + pixels * o0,
                                          .a_row = j->x + r,
                                          .b_row = j->dy + r,
                                          .rows = j->rows - r < rows_pass ? j->rows - r : rows_pass,
                                          .count = j->count,
                                          .a_stride = s.pixel,
                                          .b_stride = width,
                                          .c = sums + tap * lanes2,
                                          .c_stride = (ptrdiff_t)taps * lanes2,
                                          .fetch = (const char *)sums};
                        kernels->sum[vectors - 1][end - begin](&t);
                    }
                }
                kernels->collect(sums, lanes2, count, (end - begin) * taps, true, 1, to, row);
            }
    }
}
