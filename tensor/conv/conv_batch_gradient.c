/* The weight gradient of small images. A unit is a panel of outputs and a part of the inputs, with all taps, over all
 * pixels; nobody else touches its sums. Runs of pixels are the images at a pair of positions, so that padding is never
 * multiplied; of bf16, pairs of images. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/pairs.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    PASS_PIXELS = 128, /* a pass of one panel of dy stays in the first cache */
    PIECES = 16
};

typedef struct operands {
    const float *x;  /* [position][image][channel] */
    const float *dy; /* [panel][position][image][lane] */
    ptrdiff_t pixel; /* floats per pixel of x */
    int images;      /* of bf16: pairs of them */
} operands;

/* The same pixel of images n and n + 1, or of one that is the last. */
static void put_pair(const ts_conv *c, const float *x, int channels, int n, int count, int width, float *to)
{
    const float *odd = n + 1 < c->n ? x + (ptrdiff_t)c->h * c->w * channels : NULL;
    ts_pairs_k()->of_two(x, odd, 0, 1, count, width, to, 0);
}

static operands gather(const ts_conv *c, bool bf16, const float *x, const float *dy)
{
    const int lanes = conv_lanes(), positions = c->h * c->w, panels = conv_panels(c->oc), padded = conv_whole(c->oc),
              step = bf16 ? 2 : 1, images = (c->n + step - 1) / step;
    const ptrdiff_t pixel = c->ic % 512 ? c->ic : c->ic + 16, pixels = (ptrdiff_t)positions * images;
    float *to_x = ts_scratch(0, sizeof(float) * (size_t)(pixels * pixel)),
          *to_dy = ts_scratch(1, sizeof(float) * (size_t)(pixels * padded));
    for (int q = 0; q < positions; q++)
        for (int n = 0; n < c->n; n += step) {
            const ptrdiff_t to = (ptrdiff_t)q * images + n / step, from = (ptrdiff_t)n * positions + q;
            if (bf16) put_pair(c, x + from * c->ic, c->ic, n, c->ic, c->ic, to_x + to * pixel);
            else memcpy(to_x + to * pixel, x + from * c->ic, sizeof(float) * (size_t)c->ic);
            for (int panel = 0; panel < panels; panel++) {
                const int width = conv_vectors(c->oc, panel) * lanes, o0 = panel * 2 * lanes,
                          count = c->oc - o0 < width ? c->oc - o0 : width;
                float *at = to_dy + pixels * o0 + to * width;
                if (bf16) put_pair(c, dy + from * c->oc + o0, c->oc, n, count, width, at);
                else ts_conv_k()->panel(dy + from * c->oc + o0, 0, 1, count, at);
            }
        }
    return (operands){to_x, to_dy, pixel, images};
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
    to->count = run * s->images;
    for (int i = 0; i < c->h && run > 0; i++) {
        const int from = replicate ? conv_clamp(i + di, c->h) : i + di;
        if (from < 0 || from >= c->h) continue;
        for (int j = left; j < right; j += run) {
            to->x[to->rows] = ((ptrdiff_t)from * c->w + (replicate ? conv_clamp(j + dj, c->w) : j + dj)) * s->images *
                s->pixel;
            to->dy[to->rows++] = ((ptrdiff_t)i * c->w + j) * s->images * width;
        }
    }
}

/* The rows [begin, end) of dweight, of which length floats will be added to. */
static void fetch(const float *dweight, ptrdiff_t row, int begin, int end, int length)
{
    for (int o = begin; o < end; o++)
        for (int i = 0; i < length; i += 16) __builtin_prefetch(dweight + o * row + i, 1, 2);
}

typedef struct gradient_job {
    const ts_conv *c;
    bool bf16;
    const float *x, *dy;
    float *dweight;
    int parts; /* of the inputs */
} gradient_job;

/* What a thread has of its own. */
typedef struct own {
    operands s;
    float *sums; /* [input][tap][lane] */
    joined *of;  /* [tap], for panels of this width */
    int width;
} own;

static void run_unit(const gradient_job *g, own *o, int panel, int part)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const ts_conv *c = g->c;
    const int lanes2 = 2 * kernels->lanes, taps = c->k * c->k, vectors = conv_vectors(c->oc, panel),
              width = vectors * kernels->lanes, o0 = panel * lanes2, count = c->oc - o0 < width ? c->oc - o0 : width;
    const ptrdiff_t pixels = (ptrdiff_t)c->h * c->w * o->s.images, row = (ptrdiff_t)c->ic * taps;
    int begin, end;
    conv_part(c->ic, g->parts, part, &begin, &end);
    float *to = g->dweight + o0 * row + (ptrdiff_t)begin * taps;
    if (width != o->width)
        for (int tap = 0; tap < taps; tap++) join(c, &o->s, tap, width, &o->of[tap]);
    o->width = width;
    memset(o->sums, 0, sizeof(float) * (size_t)(taps * (end - begin) * lanes2));
    for (int tap = 0; tap < taps; tap++) {
        const joined *j = &o->of[tap];
        const int rows_pass = j->count < PASS_PIXELS ? PASS_PIXELS / (j->count > 0 ? j->count : 1) : 1;
        fetch(to, row, count * tap / taps, count * (tap + 1) / taps, (end - begin) * taps);
        for (int r = 0; r < j->rows; r += rows_pass) {
            const ts_sum t = {.a = o->s.x + begin,
                              .b = o->s.dy + pixels * o0,
                              .a_row = j->x + r,
                              .b_row = j->dy + r,
                              .rows = j->rows - r < rows_pass ? j->rows - r : rows_pass,
                              .count = j->count,
                              .a_stride = o->s.pixel,
                              .b_stride = width,
                              .c = o->sums + tap * lanes2,
                              .c_stride = (ptrdiff_t)taps * lanes2,
                              .fetch = (const char *)o->sums};
            (g->bf16 ? kernels->sum_bf16 : kernels->sum)[vectors - 1][end - begin](&t);
        }
    }
    kernels->collect(o->sums, lanes2, count, (end - begin) * taps, true, 1, to, row);
}

static void run_units(const void *job, ts_queue *queue)
{
    const gradient_job *g = job;
    const int taps = g->c->k * g->c->k;
    int64_t begin, end;
    if (!ts_next(queue, &begin, &end)) return;
    own o = {.s = gather(g->c, g->bf16, g->x, g->dy),
             .sums = ts_scratch(2, sizeof(float) * (size_t)(taps * ts_conv_k()->rows * 2 * conv_lanes())),
             .of = ts_scratch(3, sizeof(joined) * (size_t)taps)};
    do
        for (int64_t i = begin; i < end; i++) run_unit(g, &o, (int)(i / g->parts), (int)(i % g->parts));
    while (ts_next(queue, &begin, &end));
}

void conv_batch_weight_gradient(const ts_conv *c, bool bf16, const float *x, const float *dy, float *dweight)
{
    const int panels = conv_panels(c->oc), parts = (c->ic + ts_conv_k()->rows - 1) / ts_conv_k()->rows;
    const int piece = (panels * parts + PIECES - 1) / PIECES; /* of neighbouring parts, which share lines of dweight */
    ts_share_tasks(c->compute.threads, TS_SPREAD, (int64_t)panels * parts, piece, run_units,
                   &(gradient_job){c, bf16, x, dy, dweight, parts});
}
