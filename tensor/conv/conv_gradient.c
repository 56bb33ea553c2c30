/* The weight gradient, directly: a matrix product over pixels. Blocks of (tap, input) x output stay in
 * registers while pixels pass by; of bf16, pairs of neighbours in a row. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/pairs.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    PASS_PIXELS = 512,    /* a pass's inputs stay in the second cache for all panels of dy, */
    PASS_POINTWISE = 128, /* and, where they have no neighbours to share, in the first with the panel */
    CHUNK_PIXELS = 1024,  /* so many that clearing and adding the sums of a chunk is little beside making them */
    CHUNKS = 16,
    LINE = 64, /* bytes */
    UNITS = 16 /* of work, at least, where the shape allows */
};

/* The sums of a chunk are [line][m][n]: a line is a run of contiguous inputs (a kernel row, or a tap), and m, n are the
 * position in the line and the output channel, or the other way round where that leaves fewer lanes empty. n is padded.
 */
typedef struct job {
    const ts_conv *c;
    conv_plan plan; /* how x is copied into a window */
    const float *x, *dy;
    bool swapped;            /* n is the position in the line */
    bool direct_dy;          /* dy's panels are read where they are */
    bool bf16;               /* x and dy are rounded and copied as pairs of pixels */
    int lines, taps, length; /* lines, lines per kernel row, inputs per line */
    int m, n, padded;
    ptrdiff_t pixel, size;             /* floats per pixel of x and per chunk */
    float *sums, *bias_sums, *weights; /* weights: the result, NULL: not wanted */
    int chunks, groups;                /* groups of (panel of n, line) share a chunk's pixels */
} job;

/* FMAs per pixel of an m x n tile, counting what tails and short chains leave idle. */
static int64_t tile_cost(int m, int n)
{
    const int rows = ts_conv_k()->rows, tiles = (m + rows - 1) / rows, vectors = (n + conv_lanes() - 1) / conv_lanes();
    const int64_t cost = (int64_t)m * vectors, least = 8 * (int64_t)tiles * ((vectors + 1) / 2);
    return cost > least ? cost : least;
}

static job make_job(const ts_conv *c, bool bf16, const float *x, const float *dy)
{
    job g = {.c = c, .x = x, .dy = dy, .bf16 = bf16};
    g.plan = (conv_plan){.n = c->n,
                         .h = c->h,
                         .w = c->w,
                         .ic = c->ic,
                         .channels = c->ic,
                         .oc = c->oc,
                         .k = c->k,
                         .dilation = c->dilation,
                         .first = -c->dilation * (c->k / 2),
                         .replicate = c->pad == TS_PAD_REPLICATE,
                         .x = x};
    g.pixel = c->k == 1 ? c->ic : conv_window_make(&g.plan, 1, 0, 1).pixel;
    g.taps = c->dilation == 1 && g.pixel == c->ic ? 1 : c->k;
    g.lines = c->k * g.taps;
    g.length = g.taps == 1 ? c->k * c->ic : c->ic;
    /* Read where it is, x has nothing readable behind its last pixel for a whole vector. */
    const bool whole = c->k > 1 || c->ic % conv_lanes() == 0;
    g.swapped = whole && tile_cost(c->oc, g.length) < tile_cost(g.length, c->oc);
    g.m = g.swapped ? c->oc : g.length;
    g.n = g.swapped ? g.length : c->oc;
    const int lanes = conv_lanes();
    g.padded = conv_whole(g.n);
    g.size = (ptrdiff_t)g.lines * g.m * g.padded;
    g.direct_dy = !bf16 && (g.swapped || (c->oc % lanes == 0 && c->oc <= 8 * lanes));
    /* By shape alone, so that the sums do not depend on the number of threads. */
    const ptrdiff_t rows = (ptrdiff_t)c->n * c->h;
    ptrdiff_t chunks = rows * c->w / CHUNK_PIXELS;
    if (chunks > CHUNKS) chunks = CHUNKS;
    if (chunks > rows) chunks = rows;
    g.chunks = chunks < 1 ? 1 : (int)chunks;
    g.groups = (UNITS + g.chunks - 1) / g.chunks;
    if (g.groups > conv_panels(g.n) * g.lines) g.groups = conv_panels(g.n) * g.lines;
    return g;
}

/* One pass: rows [begin, end) of image n, columns [left, right), items [item, item_end) of (panel, line). */
typedef struct pass {
    int image, begin, end, left, right, item, item_end;
    bool first; /* of the chunk */
    /* What the next pass reads, fetched a little with each tile. */
    const char *next[2];
    ptrdiff_t next_bytes[2], fetched, fetch_each;
} pass;

/* dy of a pass as [pixel][lane of the panel], zeros in the lanes that do not exist. */
static void pack_dy(const job *g, const pass *s, int panel, float *to)
{
    const int lanes = conv_lanes(), oc = g->c->oc;
    const int width = conv_vectors(oc, panel) * lanes, o0 = panel * 2 * lanes, count = s->right - s->left;
    for (int i = s->begin; i < s->end; i++, to += (ptrdiff_t)count * width)
        ts_conv_k()->panel(g->dy + (((ptrdiff_t)s->image * g->c->h + i) * g->c->w + s->left) * oc + o0, oc, count,
                           oc - o0 < width ? oc - o0 : width, to);
}

static int pairs_of(int pixels) { return (pixels + 1) / 2; }

/* Channels [from, from + width) of a pass's pixels of x or dy, as pairs of neighbours; zeros where there is none. */
static void pack_pairs(const job *g, const pass *s, const float *x, int channels, int from, int width, float *to)
{
    const int pixels = s->right - s->left, there = channels - from < width ? channels - from : width;
    for (int i = s->begin; i < s->end; i++, to += (ptrdiff_t)pairs_of(pixels) * width) {
        const float *row = x + (((ptrdiff_t)s->image * g->c->h + i) * g->c->w + s->left) * channels + from;
        ts_pairs_k()->of_two(row, row + channels, 2 * channels, pixels / 2, there, width, to, width);
        if (pixels % 2)
            ts_pairs_k()->of_two(row + (ptrdiff_t)(pixels - 1) * channels, NULL, 0, 1, there, width,
                                 to + (ptrdiff_t)(pixels / 2) * width, 0);
    }
}

/* As conv_window_fill, of pairs of each pixel and the one behind it. */
static void fill_pairs(const job *g, conv_window *s, conv_window *line, int image, int first, int last)
{
    const ptrdiff_t n = (s->columns - 1) * s->pixel;
    for (int r = s->next > first ? s->next : first; r <= last; r++) {
        float *to = s->memory + r % s->rows * s->row;
        line->next = r;
        conv_window_fill(line, &g->plan, image, r, r);
        ts_pairs_k()->of_two(line->memory, line->memory + s->pixel, 0, 1, n, n, to, 0);
        ts_pairs_k()->of_two(line->memory + n, NULL, 0, 1, s->pixel, s->pixel, to + n, 0);
    }
    if (last >= s->next) s->next = last + 1;
}

/* All tiles of m of one line and one panel of n. */
static void sum_line(const job *g, ts_sum *t, pass *s, int panel, float *c)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int tiles = (g->m + kernels->rows - 1) / kernels->rows, vectors = conv_vectors(g->n, panel);
    const float *a = t->a;
    t->c_stride = g->padded;
    for (int i = 0; i < tiles; i++) {
        int begin, end;
        conv_part(g->m, tiles, i, &begin, &end);
        /* The next tile's sums, which are in memory where there are many weights. */
        const float *next = c + (ptrdiff_t)end * g->padded + panel * 2 * kernels->lanes;
        for (int m = end; m < g->m && m < end + kernels->rows; m++, next += g->padded)
            __builtin_prefetch(next, 1), __builtin_prefetch(next + 16, 1);
        t->a = a + begin;
        t->c = c + (ptrdiff_t)begin * g->padded + panel * 2 * kernels->lanes;
        t->fetch = s->fetched < s->next_bytes[0] ? s->next[0] + s->fetched
                                                 : s->next[1] + (s->fetched - s->next_bytes[0]);
        if (g->bf16) /* their kernels fetch nothing */
            for (ptrdiff_t b = 0; b < s->fetch_each; b += LINE) __builtin_prefetch(t->fetch + b, 0, 2);
        s->fetched += s->fetch_each;
        (g->bf16 ? kernels->sum_bf16 : kernels->sum)[vectors - 1][end - begin](t);
    }
    t->a = a;
}

static void run_pass(const job *g, pass *s, const conv_window *window, float *sums)
{
    const ts_conv *c = g->c;
    const int lanes = conv_lanes(), pixels = s->right - s->left, count = g->bf16 ? pairs_of(pixels) : pixels;
    const bool in_place = c->k == 1 && !g->bf16; /* x is read where it is */
    const size_t rows_count = (size_t)(s->end - s->begin) * (size_t)count;
    float *packed_dy = g->direct_dy
        ? NULL
        : ts_scratch(1, sizeof(float) * rows_count * (size_t)(g->swapped ? c->oc : 2 * lanes));
    ptrdiff_t x_row[PASS_PIXELS], dy_row[PASS_PIXELS];
    const float *x = in_place ? g->x : window->memory, *dy = g->direct_dy ? g->dy : packed_dy;
    if (g->bf16 && c->k == 1) {
        float *packed_x = ts_scratch(0, sizeof(float) * rows_count * (size_t)c->ic);
        pack_pairs(g, s, g->x, c->ic, 0, c->ic, packed_x);
        x = packed_x;
    }
    if (g->bf16 && g->swapped) pack_pairs(g, s, g->dy, c->oc, 0, c->oc, packed_dy);
    for (int item = s->item, panel_before = -1; item < s->item_end; item++) {
        const int panel = item / g->lines, line = item % g->lines, ky = line / g->taps, kx = line % g->taps;
        const int width = g->swapped ? c->oc : conv_vectors(g->n, panel) * lanes;
        if (packed_dy && panel != panel_before && !g->swapped) {
            if (g->bf16) pack_pairs(g, s, g->dy, c->oc, panel * 2 * lanes, width, packed_dy);
            else pack_dy(g, s, panel, packed_dy);
        }
        panel_before = panel;
        int rows = 0;
        for (int i = s->begin; i < s->end; i++) {
            int r = i + g->plan.first + ky * c->dilation;
            if (g->plan.replicate) r = conv_clamp(r, c->h);
            else if (r < 0 || r >= c->h) continue;
            const ptrdiff_t at = ((ptrdiff_t)s->image * c->h + i) * c->w + s->left;
            x_row[rows] = in_place ? at * c->ic
                : c->k == 1        ? (ptrdiff_t)(i - s->begin) * count * c->ic
                                   : conv_window_row(window, r) - x + (s->left + kx * c->dilation) * window->pixel;
            dy_row[rows++] = g->direct_dy ? at * c->oc : (ptrdiff_t)(i - s->begin) * count * width;
        }
        const ptrdiff_t dy_stride = g->direct_dy ? c->oc : width,
                        x_stride = g->bf16 && c->k > 1 ? 2 * g->pixel : g->pixel;
        ts_sum t = {
            .rows = rows, .count = count, .begin = s->first, .fetch_step = s->fetch_each / (rows * (count / 2) + 1)};
        if (g->swapped) {
            t.a = dy, t.a_row = dy_row, t.a_stride = dy_stride;
            t.b = x + panel * 2 * lanes, t.b_row = x_row, t.b_stride = x_stride;
        } else {
            t.a = x, t.a_row = x_row, t.a_stride = x_stride;
            t.b = g->direct_dy ? dy + panel * 2 * lanes : dy, t.b_row = dy_row, t.b_stride = dy_stride;
        }
        sum_line(g, &t, s, panel, sums + (ptrdiff_t)line * g->m * g->padded);
    }
}

/* What the pass after rows up to row_end (counted over all images) will read. */
static void plan_fetch(const job *g, pass *s, int row_end, int rows, int column_parts)
{
    const ts_conv *c = g->c;
    const int all = c->n * c->h, m_tiles = (g->m + ts_conv_k()->rows - 1) / ts_conv_k()->rows;
    int x_row = row_end + c->dilation * (c->k / 2), dy_row = row_end;
    if (x_row > all - rows) x_row = all > rows ? all - rows : 0;
    if (dy_row > all - rows) dy_row = all > rows ? all - rows : 0;
    s->next[0] = (const char *)(g->x + (ptrdiff_t)x_row * c->w * c->ic);
    s->next[1] = (const char *)(g->dy + (ptrdiff_t)dy_row * c->w * c->oc);
    s->next_bytes[0] = (ptrdiff_t)sizeof(float) * rows * c->w * c->ic;
    s->next_bytes[1] = (ptrdiff_t)sizeof(float) * rows * c->w * c->oc;
    s->fetched = 0;
    s->fetch_each = (s->next_bytes[0] + s->next_bytes[1]) /
        ((ptrdiff_t)column_parts * (s->item_end - s->item) * m_tiles);
}

/* A chunk's rows (counted over all images) into its sums, for one group of (panel, line); group 0 also makes the bias.
 */
static void run_chunk(const job *g, int chunk, int group, bool weights)
{
    const ts_conv *c = g->c;
    const int most = c->k == 1 ? PASS_POINTWISE : PASS_PIXELS, rows_pass = c->w < most ? most / c->w : 1,
              column_parts = (c->w + most - 1) / most;
    const int reach = (c->k - 1) * c->dilation;
    const bool windowed = weights && c->k > 1;
    pass s = {0};
    int begin, end;
    conv_part(c->n * c->h, g->chunks, chunk, &begin, &end);
    conv_part(conv_panels(g->n) * g->lines, g->groups, group, &s.item, &s.item_end);
    float *sums = g->sums + chunk * g->size,
          *bias = g->bias_sums && group == 0 ? g->bias_sums + (ptrdiff_t)chunk * c->oc : NULL;
    if (bias) memset(bias, 0, sizeof(float) * (size_t)c->oc);
    conv_window window = {0}, line = {0};
    if (windowed) {
        window = conv_window_make(&g->plan, rows_pass + reach, g->plan.first, c->w + reach);
        line = conv_window_make(&g->plan, 1, g->plan.first, c->w + reach);
        const size_t size = conv_window_size(&window), more = g->bf16 ? conv_window_size(&line) : 0;
        window.memory = ts_scratch(0, (size + more) * sizeof(float));
        line.memory = window.memory + size;
    }
    for (int row = begin, image_before = -1; row < end; row += s.end - s.begin) {
        s.image = row / c->h;
        s.begin = row % c->h;
        s.end = s.begin + rows_pass;
        if (s.end > c->h) s.end = c->h;
        if (s.end - s.begin > end - row) s.end = s.begin + end - row;
        if (s.image != image_before) window.next = 0;
        image_before = s.image;
        if (windowed) {
            const int low = s.begin + g->plan.first, high = s.end - 1 + g->plan.first + reach;
            if (g->bf16) fill_pairs(g, &window, &line, s.image, conv_clamp(low, c->h), conv_clamp(high, c->h));
            else conv_window_fill(&window, &g->plan, s.image, conv_clamp(low, c->h), conv_clamp(high, c->h));
        }
        if (weights) plan_fetch(g, &s, row + s.end - s.begin, s.end - s.begin, column_parts);
        for (int b = 0; weights && b < column_parts; b++) {
            conv_part(c->w, column_parts, b, &s.left, &s.right);
            s.first = row == begin && b == 0;
            run_pass(g, &s, &window, sums);
        }
        if (bias)
            ts_conv_k()->columns(g->dy + (ptrdiff_t)row * c->w * c->oc, (int64_t)(s.end - s.begin) * c->w, c->oc, bias);
    }
}

/* Adds n values of all chunks, in order. */
static void add_chunks(const job *g, ptrdiff_t at, int n, float *sum)
{
    memcpy(sum, g->sums + at, sizeof(float) * (size_t)n);
    for (int i = 1; i < g->chunks; i++) {
        const float *other = g->sums + i * g->size + at;
        for (int j = 0; j < n; j++) sum[j] += other[j];
    }
}

enum { REDUCE_OUTPUTS = 32, REDUCE_INPUTS = 16 };

/* Outputs [o0, o1) and inputs [c0, c1): together small enough that the places they go to, taps fastest, stay in cache.
 */
static void reduce_part(const job *g, int o0, int o1, int c0, int c1, float *dweight)
{
    const ts_conv *c = g->c;
    const ptrdiff_t taps = (ptrdiff_t)c->k * c->k;
    float sum[REDUCE_OUTPUTS > REDUCE_INPUTS ? REDUCE_OUTPUTS : REDUCE_INPUTS];
    for (int tap = 0; tap < taps; tap++) {
        const int line = g->taps == 1 ? tap / c->k : tap, q0 = g->taps == 1 ? tap % c->k * c->ic : 0;
        const ptrdiff_t at = (ptrdiff_t)line * g->m * g->padded;
        if (g->swapped)
            for (int o = o0; o < o1; o++) {
                add_chunks(g, at + (ptrdiff_t)o * g->padded + q0 + c0, c1 - c0, sum);
                float *to = dweight + ((ptrdiff_t)o * c->ic + c0) * taps + tap;
                for (int i = 0; i < c1 - c0; i++) to[i * taps] += sum[i];
            }
        else
            for (int i = c0; i < c1; i++) {
                add_chunks(g, at + (ptrdiff_t)(q0 + i) * g->padded + o0, o1 - o0, sum);
                float *to = dweight + ((ptrdiff_t)o0 * c->ic + i) * taps + tap;
                for (int o = 0; o < o1 - o0; o++) to[o * c->ic * taps] += sum[o];
            }
    }
}

static void run_unit(const void *made, int64_t unit)
{
    const job *g = made;
    const int groups = g->weights ? g->groups : 1;
    run_chunk(g, (int)(unit / groups), (int)(unit % groups), g->weights != NULL);
}

static void reduce_parts(const void *made, int64_t begin, int64_t end)
{
    const job *g = made;
    const ts_conv *c = g->c;
    const int c_parts = (c->ic + REDUCE_INPUTS - 1) / REDUCE_INPUTS;
    for (int64_t at = begin; at < end; at++) {
        const int o = (int)(at / c_parts) * REDUCE_OUTPUTS, i = (int)(at % c_parts) * REDUCE_INPUTS;
        reduce_part(g, o, o + REDUCE_OUTPUTS < c->oc ? o + REDUCE_OUTPUTS : c->oc, i,
                    i + REDUCE_INPUTS < c->ic ? i + REDUCE_INPUTS : c->ic, g->weights);
    }
}

void conv_direct_weight_gradient(const ts_conv *c, bool bf16, const float *x, const float *dy, float *dweight,
                                 float *dbias)
{
    job made = make_job(c, bf16, x, dy), *g = &made;
    const size_t of_weights = dweight ? (size_t)(g->size * g->chunks) : 0;
    g->weights = dweight;
    g->sums = ts_scratch(2, sizeof(float) * (of_weights + (size_t)(c->oc * g->chunks)));
    g->bias_sums = dbias ? g->sums + of_weights : NULL;
    const int groups = dweight ? g->groups : 1, o_parts = dweight ? (c->oc + REDUCE_OUTPUTS - 1) / REDUCE_OUTPUTS : 0;
    const int c_parts = (c->ic + REDUCE_INPUTS - 1) / REDUCE_INPUTS;
    ts_spread_tasks(c->compute.threads, (int64_t)g->chunks * groups, run_unit, g);
    ts_for(c->compute.threads, (int64_t)o_parts * c_parts, 1, reduce_parts, g);
    for (int i = 0; dbias && i < g->chunks; i++)
        for (int o = 0; o < c->oc; o++) dbias[o] += g->bias_sums[(ptrdiff_t)i * c->oc + o];
}
