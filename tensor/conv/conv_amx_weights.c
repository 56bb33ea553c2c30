/* The gradient of weights by the matrix unit: for each tap the product of x, channel by channel, and dy, pixel by
 * pixel, over the pixels of a band. Both are packed as lines (tensor/conv/conv_amx.c) with dy zero on the halo's
 * columns, so that a tap is but another place to begin at in x. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/amx_conv.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    STEP_PIXELS = 2 * TS_AMX_PAIRS,
    BAND_BYTES = 640 << 10, /* x and dy of a band: they stay in the second cache for all taps */
    CHUNK_PIXELS = 4096,    /* so many that clearing and adding a chunk's sums is little beside making them */
    CHUNKS = 8,
    UNITS = 8, /* of work, at least, where the shape allows */
    REDUCE_INPUTS = 16
};

typedef struct job {
    const ts_conv *c;
    const ts_conv_inputs *x;
    const float *dy;
    int first;           /* channels of x->x */
    int reach, columns;  /* columns of a line: even, so that pairs of pixels do not straddle rows */
    int ic, oc;          /* whole tiles */
    int chunks, groups;  /* of rows over all images; of parts of the inputs */
    const ptrdiff_t *at; /* of steps, in x */
    float *sums;         /* [chunk][tap][ic][oc] */
    ptrdiff_t size;      /* of a chunk's */
    float *dweight;
} job;

static int round_up(int n, int to) { return (n + to - 1) / to * to; }

/* Pixels of a line of so many rows of dy, in whole steps. */
static int line_pixels(const job *g, int rows) { return round_up(rows * g->columns, STEP_PIXELS); }

/* bf16 values of a channel's plane: what the last tap reads of the last step exists. Planes a multiple of 4 KiB apart
 * would share few sets of the first cache. */
static ptrdiff_t plane_of(const job *g, int rows)
{
    const int line = round_up(line_pixels(g, rows) + g->reach * (g->columns + 1), 32);
    return line / 32 % 2 ? line : line + 32;
}

static int band_rows(const job *g, int inputs)
{
    const ptrdiff_t row = (ptrdiff_t)g->columns * 2 * (inputs + g->oc),
                    halo = (ptrdiff_t)g->columns * 2 * inputs * g->reach;
    const ptrdiff_t rows = (BAND_BYTES - halo) / row;
    return rows < 4 ? 4 : rows < g->c->h ? (int)rows : g->c->h;
}

/* Rows [begin, end) of dy and what their taps read of channels [c0, c1). */
static void pack_band(const job *g, int image, int begin, int end, int c0, int c1, uint16_t *x, ptrdiff_t plane,
                      float *dy)
{
    const ts_conv *c = g->c;
    const struct ts_amx_kernels *k = ts_amx_k();
    const int half = g->reach / 2, rows = end - begin, exist = (c1 < c->ic ? c1 : c->ic) - c0,
              left = g->first > c0 ? g->first - c0 : 0, before = left < exist ? left : exist; /* of x->x */
    for (int r = 0; r < rows + g->reach; r++) {
        const int at = begin + r - half, source = conv_clamp(at, c->h);
        const ptrdiff_t from = ((ptrdiff_t)image * c->h + source) * c->w;
        uint16_t *to = x + (ptrdiff_t)r * g->columns;
        if (source != at && c->pad == TS_PAD_ZERO) {
            for (int i = 0; i < exist; i++) memset(to + i * plane, 0, sizeof *x * (size_t)g->columns);
            continue;
        }
        k->planes(g->x->x + from * g->first + c0, g->first, c->w, before, to + half, plane);
        if (before < exist)
            k->planes(g->x->constants + from * c->constants + c0 + before - g->first, c->constants, c->w,
                      exist - before, to + half + before * plane, plane);
        for (int i = 0; i < exist; i++, to += plane) {
            const bool zero = c->pad == TS_PAD_ZERO;
            for (int j = 0; j < half; j++) to[j] = zero ? 0 : to[half];
            for (int j = half + c->w; j < g->columns; j++) to[j] = zero ? 0 : to[half + c->w - 1];
        }
    }
    const ptrdiff_t there = (ptrdiff_t)(rows + g->reach) * g->columns; /* behind, dy is zero; x must be finite */
    for (int i = 0; i < exist; i++) memset(x + i * plane + there, 0, sizeof *x * (size_t)(plane - there));
    memset(x + exist * plane, 0, sizeof *x * (size_t)(plane * (c1 - c0 - exist)));
    const int pairs = line_pixels(g, rows) / 2, in_row = (c->w + 1) / 2;
    for (int r = 0; r < rows; r++) {
        float *to = dy + (ptrdiff_t)r * (g->columns / 2) * g->oc;
        k->pixel_pairs(g->dy + ((ptrdiff_t)image * c->h + begin + r) * c->w * c->oc, c->oc, c->w, c->oc, to, g->oc);
        memset(to + (ptrdiff_t)in_row * g->oc, 0, sizeof(float) * (size_t)(g->columns / 2 - in_row) * (size_t)g->oc);
    }
    const int done = rows * (g->columns / 2);
    memset(dy + (ptrdiff_t)done * g->oc, 0, sizeof(float) * (size_t)(pairs - done) * (size_t)g->oc);
}

/* All taps, channels [c0, c1) and outputs, of a packed band. */
static void add_band(const job *g, int rows, int c0, int c1, const uint16_t *x, ptrdiff_t plane, const float *dy,
                     float *sums)
{
    const ts_conv *c = g->c;
    const struct ts_amx_kernels *k = ts_amx_k();
    for (int o = 0; o < g->oc; o += TS_AMX_BLOCK)
        for (int i = c0; i < c1; i += TS_AMX_BLOCK)
            for (int tap = 0; tap < c->k * c->k; tap++) {
                const ptrdiff_t shift = ((ptrdiff_t)(tap / c->k) * g->columns + tap % c->k) * c->dilation;
                const ts_amx_product m = {.a = x + (i - c0) * plane + shift,
                                          .b = dy + o,
                                          .a_at = g->at,
                                          .a_row = plane * (ptrdiff_t)sizeof *x,
                                          .b_row = g->oc,
                                          .steps = line_pixels(g, rows) / STEP_PIXELS,
                                          .c = sums + ((ptrdiff_t)tap * g->ic + i) * g->oc + o,
                                          .c_row = g->oc,
                                          .add = true};
                k->product[c1 - i > TS_AMX_SIDE][g->oc - o > TS_AMX_SIDE](&m);
            }
}

static void run_chunk(const job *g, int chunk, int group)
{
    const ts_conv *c = g->c;
    int begin, end, part0, part1;
    conv_part(c->n * c->h, g->chunks, chunk, &begin, &end);
    conv_part((g->ic + TS_AMX_BLOCK - 1) / TS_AMX_BLOCK, g->groups, group, &part0, &part1);
    const int c0 = part0 * TS_AMX_BLOCK, c1 = part1 * TS_AMX_BLOCK < g->ic ? part1 * TS_AMX_BLOCK : g->ic,
              rows = band_rows(g, c1 - c0);
    float *sums = g->sums + chunk * g->size;
    for (int tap = 0; tap < c->k * c->k; tap++)
        memset(sums + ((ptrdiff_t)tap * g->ic + c0) * g->oc, 0, sizeof(float) * (size_t)(c1 - c0) * (size_t)g->oc);
    const ptrdiff_t plane = plane_of(g, rows);
    uint16_t *x = ts_scratch(0, sizeof *x * (size_t)plane * (size_t)(c1 - c0));
    float *dy = ts_scratch(1, sizeof(float) * (size_t)(line_pixels(g, rows) / 2) * (size_t)g->oc);
    ts_amx_k()->begin();
    for (int row = begin, next; row < end; row = next) {
        const int image = row / c->h, first = row % c->h;
        int last = first + rows;
        if (last > c->h) last = c->h;
        if (last - first > end - row) last = first + end - row;
        next = row + last - first;
        pack_band(g, image, first, last, c0, c1, x, plane, dy);
        add_band(g, last - first, c0, c1, x, plane, dy, sums);
    }
    ts_amx_k()->end();
}

/* Inputs [c0, c1) of outputs [o0, o1): so few that the places they go to, taps fastest, stay in cache. */
static void reduce_part(const job *g, int o0, int o1, int c0, int c1, float *dweight)
{
    const int taps = g->c->k * g->c->k;
    for (int tap = 0; tap < taps; tap++)
        for (int i = c0; i < c1; i++) {
            const float *from = g->sums + ((ptrdiff_t)tap * g->ic + i) * g->oc;
            float sum[TS_AMX_BLOCK], *to = dweight + (ptrdiff_t)i * taps + tap;
            for (int o = o0; o < o1; o++) sum[o - o0] = from[o];
            for (int chunk = 1; chunk < g->chunks; chunk++)
                for (int o = o0; o < o1; o++) sum[o - o0] += from[chunk * g->size + o];
            for (int o = o0; o < o1; o++) to[(ptrdiff_t)o * g->c->ic * taps] += sum[o - o0];
        }
}

static void run_unit(const void *made, int64_t unit)
{
    const job *g = made;
    run_chunk(g, (int)(unit / g->groups), (int)(unit % g->groups));
}

static void reduce_parts(const void *made, int64_t begin, int64_t end)
{
    const job *g = made;
    const int parts = (g->c->ic + REDUCE_INPUTS - 1) / REDUCE_INPUTS, oc = g->c->oc, ic = g->c->ic;
    for (int64_t at = begin; at < end; at++) {
        const int o = (int)(at / parts) * TS_AMX_BLOCK, i = (int)(at % parts) * REDUCE_INPUTS;
        reduce_part(g, o, o + TS_AMX_BLOCK < oc ? o + TS_AMX_BLOCK : oc, i,
                    i + REDUCE_INPUTS < ic ? i + REDUCE_INPUTS : ic, g->dweight);
    }
}

void conv_amx_weight_gradient(const ts_conv *c, const ts_conv_inputs *x, const float *dy, float *dweight)
{
    job g = {.c = c,
             .x = x,
             .dy = dy,
             .dweight = dweight,
             .first = x->constants ? ts_conv_variables(c) : c->ic,
             .reach = (c->k - 1) * c->dilation,
             .ic = round_up(c->ic, TS_AMX_SIDE),
             .oc = round_up(c->oc, TS_AMX_SIDE)};
    g.columns = round_up(c->w + g.reach, 2);
    g.size = (ptrdiff_t)c->k * c->k * g.ic * g.oc;
    /* By shape alone, so that the sums do not depend on the number of threads. */
    const ptrdiff_t rows = (ptrdiff_t)c->n * c->h, chunks = rows * c->w / CHUNK_PIXELS,
                    most = CHUNKS < rows ? CHUNKS : rows;
    g.chunks = (int)(chunks < 1 ? 1 : chunks < most ? chunks : most);
    const int input_parts = (g.ic + TS_AMX_BLOCK - 1) / TS_AMX_BLOCK, groups = (UNITS + g.chunks - 1) / g.chunks;
    g.groups = groups < input_parts ? groups : input_parts;
    /* of the longest line: the fewer inputs, the more rows a band has */
    const int steps = line_pixels(&g, band_rows(&g, TS_AMX_SIDE)) / STEP_PIXELS;
    ptrdiff_t *at = ts_scratch(3, sizeof *at * (size_t)steps);
    for (int s = 0; s < steps; s++) at[s] = s * (ptrdiff_t)(STEP_PIXELS * sizeof(uint16_t));
    g.at = at;
    g.sums = ts_scratch(2, sizeof(float) * (size_t)(g.size * g.chunks));
    ts_spread_tasks(c->compute.threads, (int64_t)g.chunks * g.groups, run_unit, &g);
    ts_for(c->compute.threads,
           (int64_t)((c->oc + TS_AMX_BLOCK - 1) / TS_AMX_BLOCK) * ((c->ic + REDUCE_INPUTS - 1) / REDUCE_INPUTS), 1,
           reduce_parts, &g);
}
