#include "tensor/conv/gru_internal.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    PART_PIXELS = 1024, /* weight gradients: private sums for so many pixels at least, */
    PARTS = 16          /* and no more of them, by shape alone */
};

static ts_conv product_of(const ts_gru *g, int ic)
{
    return (ts_conv){
        .n = 1, .h = 1, .w = 1, .ic = ic, .oc = 3 * g->c, .k = 1, .dilation = 1, .compute.threads = g->threads};
}

ts_conv ts_gru_input(const ts_gru *g) { return product_of(g, g->ic); }
ts_conv ts_gru_hidden(const ts_gru *g) { return product_of(g, g->c); }

static conv_plan gates_of(const ts_gru *g, int channels, const float *packed, const float *bias)
{
    return (conv_plan){.ic = g->bf16 ? conv_bf16_depth(channels) : channels,
                       .channels = channels,
                       .oc = 3 * g->c,
                       .k = 1,
                       .packed = packed,
                       .bias = bias,
                       .leak = 1,
                       .bf16 = g->bf16};
}

/* y [count][3c] = the gates of x [count][channels] */
static void gates_forward(conv_plan p, const float *x, int count, float *y)
{
    p.x = x;
    p.y = y;
    if (p.bf16) {
        const size_t behind = (size_t)(CONV_AMX_SLACK * (p.ic + 1));
        float *rounded = ts_scratch(2, sizeof(float) * ((size_t)(GRU_BAND * p.ic) + behind));
        conv_put_pixels(&p, x, count, rounded, p.ic);
        p.x = rounded;
        if (conv_amx_present()) {
            memset(rounded + count * p.ic, 0, behind * sizeof(float));
            conv_amx_pixels(&p, count);
            return;
        }
    }
    conv_run_pixels(&p, 0, count, 0, conv_panels(p.oc));
}

typedef struct forward_job {
    const ts_gru *g;
    conv_plan input, hidden;
    const float *x, *old, *hh_bias;
    float *y, *saved;
} forward_job;

static void forward_band(const forward_job *j, int64_t p)
{
    const ts_gru *g = j->g;
    const int gates = 3 * g->c, count = (int)(g->pixels - p < GRU_BAND ? g->pixels - p : GRU_BAND);
    float *ih = ts_scratch(0, sizeof(float) * (size_t)(GRU_BAND * gates)),
          *hh = ts_scratch(1, sizeof(float) * (size_t)(GRU_BAND * gates));
    gates_forward(j->input, j->x + p * g->ic, count, ih);
    const float *old = j->old ? j->old + p * g->c : NULL;
    if (old) gates_forward(j->hidden, old, count, hh);
    /* A zero state leaves of the hidden gates their bias. */
    ts_elementwise_k()->gru(count, g->c, ih, old ? hh : j->hh_bias, old ? gates : 0, old, j->y + p * g->c,
                            j->saved ? j->saved + p * 4 * g->c : NULL);
}

static void forward_bands(const void *job, ts_queue *queue)
{
    for (int64_t begin, end; ts_next(queue, &begin, &end);)
        for (int64_t i = begin; i < end; i++) forward_band(job, i * GRU_BAND);
}

void ts_gru_forward(const ts_gru *g, const float *x, const float *old, const float *ih_packed, const float *ih_bias,
                    const float *hh_packed, const float *hh_bias, float *y, float *saved)
{
    enum { BANDS = 4 }; /* at a time */
    ts_share_tasks(g->threads, TS_SPREAD, (g->pixels + GRU_BAND - 1) / GRU_BAND, BANDS, forward_bands,
                   &(forward_job){g, gates_of(g, g->ic, ih_packed, ih_bias), gates_of(g, g->c, hh_packed, hh_bias), x,
                                  old, hh_bias, y, saved});
}

/* y[p] (+)= the sum over runs of channels of a[p]: a band's data gradient. */
static void product(const float *a, ptrdiff_t a_stride, const ts_segment *segment, int segments, int depth,
                    const float *packed, int oc, float *y, bool add, int count)
{
    const struct ts_conv_kernels *k = ts_conv_k();
    const conv_plan plan = {.ic = depth, .oc = oc, .k = 1, .packed = packed, .leak = 1, .base = add ? y : NULL};
    for (int panel = 0; panel < conv_panels(oc); panel++) {
        ts_tile t = conv_panel_tile(&plan, panel);
        t.segment = segment;
        t.segments = segments;
        t.a_stride = a_stride;
        for (int p = 0; p < count; p += k->pixels)
            conv_run_tile(&t, conv_vectors(oc, panel), a + p * a_stride, y + (ptrdiff_t)p * oc + panel * 2 * k->lanes,
                          count - p < k->pixels ? count - p : k->pixels, false);
    }
}

/* Private sums of a part: [3c][padded ic], [3c][padded c], and in double [4c]. The 4c gradients of a pixel before the
 * activations come as n, z, r, n' (n' that of hh_n), so that both ih's and hh's three are neighbours. */
typedef struct sums {
    float *input, *hidden;
    double *bias;
} sums;

/* c[m][i] += sum_p d[p][m] b[p][i] for 3c values of m */
static void add_products(const float *d, int c, const float *b, int channels, int count, float *sum)
{
    const struct ts_conv_kernels *k = ts_conv_k();
    const int width = conv_whole(channels), tiles = (3 * c + k->rows - 1) / k->rows;
    const ptrdiff_t zero = 0;
    ptrdiff_t b_stride = channels;
    if (width != channels) { /* whole vectors are read */
        float *wide = ts_scratch(1, sizeof(float) * (size_t)(GRU_BAND * width));
        for (int p = 0; p < count; p++) {
            memcpy(wide + (ptrdiff_t)p * width, b + (ptrdiff_t)p * channels, sizeof(float) * (size_t)channels);
            memset(wide + (ptrdiff_t)p * width + channels, 0, sizeof(float) * (size_t)(width - channels));
        }
        b = wide;
        b_stride = width;
    }
    for (int panel = 0; panel < conv_panels(channels); panel++)
        for (int i = 0; i < tiles; i++) {
            int begin, end;
            conv_part(3 * c, tiles, i, &begin, &end);
            const ts_sum t = {.a = d + begin,
                              .b = b + panel * 2 * k->lanes,
                              .a_row = &zero,
                              .b_row = &zero,
                              .rows = 1,
                              .count = count,
                              .a_stride = 4 * c,
                              .b_stride = b_stride,
                              .c = sum + (ptrdiff_t)begin * width + panel * 2 * k->lanes,
                              .c_stride = width,
                              .fetch = (const char *)d};
            k->sum[conv_vectors(channels, panel) - 1][end - begin](&t);
        }
}

static void run_band(const ts_gru *g, int64_t p, int count, const float *x, const float *old, const float *ih_packed,
                     const float *hh_packed, const float *saved, const float *dy, const ts_gru_gradients *to, sums s)
{
    const int c = g->c;
    const ts_segment input[2] = {{c, 0, 2 * c}, {0, 2 * c, c}}, hidden = {c, 0, 3 * c};
    float *d = ts_scratch(0, sizeof(float) * (size_t)(GRU_BAND * 4 * c)), *dold = to->dold ? to->dold + p * c : NULL;
    ts_elementwise_k()->gru_backward(count, c, saved + p * 4 * c, old ? old + p * c : NULL, dy + p * c, d, dold,
                                     to->dold_add, s.bias);
    if (ts_gru_backward_bf16(g)) {
        const gru_rounded r = gru_round(g, d, count);
        if (dold) gru_amx_product(&r, true, hh_packed, c, dold, true);
        if (to->dx) gru_amx_product(&r, false, ih_packed, g->ic, to->dx + p * g->ic, to->dx_add);
        if (to->ih_weight) gru_amx_weights(&r, false, x + p * g->ic, g->ic, s.input);
        if (to->hh_weight && old) gru_amx_weights(&r, true, old + p * c, c, s.hidden);
        return;
    }
    if (dold) product(d, 4 * c, &hidden, 1, 3 * c, hh_packed, c, dold, true, count);
    if (to->dx) product(d, 4 * c, input, 2, 3 * c, ih_packed, g->ic, to->dx + p * g->ic, to->dx_add, count);
    if (to->ih_weight) add_products(d, c, x + p * g->ic, g->ic, count, s.input);
    if (to->hh_weight && old) add_products(d + c, c, old + p * c, c, count, s.hidden);
}

/* The parts' sums of one row, in order of the parts, added to its place. */
static void reduce_row(const float *first, ptrdiff_t part, int parts, int channels, float *to)
{
    for (int i = 0; i < channels; i++) {
        float sum = first[i];
        for (int j = 1; j < parts; j++) sum += first[j * part + i];
        to[i] += sum;
    }
}

static void reduce_bias(const double *first, ptrdiff_t part, int parts, int c, const ts_gru_gradients *to)
{
    for (int i = 0; i < 4 * c; i++) {
        double sum = 0;
        for (int j = 0; j < parts; j++) sum += first[j * part + i];
        const int chunk = i / c, at = i % c;
        if (to->ih_bias && chunk < 3) to->ih_bias[(chunk + 2) % 3 * c + at] += (float)sum;
        if (to->hh_bias && chunk > 0) to->hh_bias[(chunk - 1) * c + at] += (float)sum;
    }
}

typedef struct backward_job {
    const ts_gru *g;
    const float *x, *old, *ih_packed, *hh_packed, *saved, *dy;
    const ts_gru_gradients *to;
    int parts;
    ptrdiff_t input, size; /* of a part: floats of its first sums; all of it, in doubles */
    double *memory;
} backward_job;

static void backward_part(const void *job, int64_t part)
{
    const backward_job *j = job;
    const ts_gru *g = j->g;
    double *own = j->memory + part * j->size;
    float *weights = (float *)(void *)(own + 4 * g->c);
    memset(own, 0, sizeof(double) * (size_t)j->size);
    const sums s = {weights, weights + j->input, j->to->ih_bias || j->to->hh_bias ? own : NULL};
    const int64_t begin = g->pixels * part / j->parts, end = g->pixels * (part + 1) / j->parts;
    for (int64_t p = begin; p < end; p += GRU_BAND)
        run_band(g, p, (int)(end - p < GRU_BAND ? end - p : GRU_BAND), j->x, j->old, j->ih_packed, j->hh_packed,
                 j->saved, j->dy, j->to, s);
}

static void reduce_rows(const void *job, int64_t begin, int64_t end)
{
    const backward_job *j = job;
    const int c = j->g->c, ic = j->g->ic, gates = 3 * c;
    const float *first = (const float *)(const void *)(j->memory + 4 * c);
    for (int64_t m = begin; m < end; m++) {
        if (j->to->ih_weight)
            reduce_row(first + m * conv_whole(ic), 2 * j->size, j->parts, ic,
                       j->to->ih_weight + (m + 2 * c) % gates * ic);
        if (j->to->hh_weight && j->old)
            reduce_row(first + j->input + m * conv_whole(c), 2 * j->size, j->parts, c, j->to->hh_weight + m * c);
    }
}

void ts_gru_backward(const ts_gru *g, const float *x, const float *old, const float *ih_packed, const float *hh_packed,
                     const float *saved, const float *dy, const ts_gru_gradients *to)
{
    const int c = g->c, gates = 3 * c;
    const int64_t most = g->pixels / PART_PIXELS;
    const int parts = most < 1 ? 1 : most > PARTS ? PARTS : (int)most;
    const ptrdiff_t input = (ptrdiff_t)gates * conv_whole(g->ic), hidden = (ptrdiff_t)gates * conv_whole(c);
    const ptrdiff_t size = 4 * c + (input + hidden + 1) / 2;
    double *memory = ts_scratch(2, sizeof(double) * (size_t)(size * parts));
    const backward_job j = {g, x, old, ih_packed, hh_packed, saved, dy, to, parts, input, size, memory};
    ts_spread_tasks(g->threads, parts, backward_part, &j);
    ts_for(g->threads, gates, 1, reduce_rows, &j);
    if (to->ih_bias || to->hh_bias) reduce_bias(memory, size, parts, c, to);
}
