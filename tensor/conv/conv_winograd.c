/* Winograd's convolutions F(4 x 4, 3 x 3), 36 products in place of 144 for 4 x 4 pixels (Lavin and Gray 2016), and
 * F(2 x 2, 5 x 5), 36 in place of 100 for 2 x 2. Some tiles at a time are transformed, multiplied as 36 small matrix
 * products, and transformed back. The gradient of the input is a convolution of the output's, with mirrored taps. */
#include "tensor/conv/conv_winograd.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/kernels/winograd.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <string.h>

enum {
    TILES = 28 /* two full register tiles; their 36 inputs and outputs stay in the second cache beside the weights */
};

/* Tiles along a side of the interleaved images, the largest of which has ceil(size / dilation) pixels. */
static int tiles_along(int size, int dilation, int side)
{
    return ((size + dilation - 1) / dilation + side - 1) / side;
}

static winograd_grid with_tiles(winograd_grid g)
{
    g.rows = tiles_along(g.out_h, g.dilation, g.side);
    g.columns = tiles_along(g.out_w, g.dilation, g.side);
    g.tiles = (int64_t)g.n * g.dilation * g.dilation * g.rows * g.columns;
    return g;
}

winograd_grid winograd_grid_forward(const ts_conv *c, bool bf16)
{
    return with_tiles((winograd_grid){.threads = c->compute.threads,
                                      .bf16 = bf16,
                                      .n = c->n,
                                      .h = c->h,
                                      .w = c->w,
                                      .ic = c->ic,
                                      .out_h = c->h,
                                      .out_w = c->w,
                                      .oc = c->oc,
                                      .dilation = c->dilation,
                                      .side = WINOGRAD_REACH + 1 - c->k,
                                      .first_row = -c->dilation * (c->k / 2),
                                      .first_column = -c->dilation * (c->k / 2),
                                      .replicate = c->pad == TS_PAD_REPLICATE});
}

winograd_grid winograd_grid_gradient(const ts_conv *c, winograd_part part, bool bf16)
{
    return with_tiles((winograd_grid){.threads = c->compute.threads,
                                      .bf16 = bf16,
                                      .n = c->n,
                                      .h = c->h,
                                      .w = c->w,
                                      .ic = c->oc,
                                      .out_h = part.h,
                                      .out_w = part.w,
                                      .oc = ts_conv_variables(c),
                                      .dilation = c->dilation,
                                      .side = WINOGRAD_REACH + 1 - c->k,
                                      .first_row = part.row - c->dilation * (c->k / 2),
                                      .first_column = part.column - c->dilation * (c->k / 2)});
}

/* Inputs as products count them. */
static int depth_of(int ic, bool bf16) { return bf16 ? conv_bf16_depth(ic) : ic; }

size_t conv_winograd_count(int ic, int oc, bool bf16)
{
    return (size_t)conv_panels_count(depth_of(ic, bf16), oc, 1) * WINOGRAD_AREA;
}

typedef struct pack_job {
    const ts_conv *c;
    const conv_weights *w;
    bool forward, bf16;
    int ic, step, parts; /* an even step: no pair is parted */
    ptrdiff_t plane;
    float *packed;
} pack_job;

static void pack_part(const pack_job *j, int panel, int part)
{
    float transposed[2 * 16 * CONV_TRANSPOSED]; /* no vector has more than 16 lanes */
    const int begin = part * j->step, count = j->ic - begin < j->step ? j->ic - begin : j->step;
    const int taps = j->c->k * j->c->k, last = j->forward ? 0 : taps - 1; /* a gradient's taps are mirrored */
    const int width = conv_transpose(j->c, j->w, j->forward, panel, begin, count, transposed);
    float *to = j->packed + (ptrdiff_t)panel * 2 * conv_lanes() * depth_of(j->ic, j->bf16);
    for (int i = 0; i < count; i++) {
        const ts_winograd_form form = !j->bf16 ? TS_WINOGRAD_F32 : i % 2 ? TS_WINOGRAD_ODD : TS_WINOGRAD_EVEN;
        const ptrdiff_t row = j->bf16 ? (begin + i) / 2 : begin + i;
        ts_winograd_k()->weights[j->c->k == 5][form](transposed + (i * taps + last) * width, last ? -width : width,
                                                     width / conv_lanes(), to + row * width, j->plane);
    }
}

static void pack_parts(const void *job, int64_t begin, int64_t end)
{
    const pack_job *j = job;
    for (int64_t i = begin; i < end; i++) pack_part(j, (int)(i / j->parts), (int)(i % j->parts));
}

/* packed: [36][panel][input, or pair of inputs][channel of the panel] = G g G' */
void conv_winograd_pack(const ts_conv *c, bool forward, bool bf16, const conv_weights *w, float *packed)
{
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c);
    const int step = conv_transposed_inputs(c->k * c->k) & ~1, parts = (ic + step - 1) / step;
    ts_for(c->compute.threads, (int64_t)conv_panels(oc) * parts, 1, pack_parts,
           &(pack_job){c, w, forward, bf16, ic, step, parts, conv_panels_count(depth_of(ic, bf16), oc, 1), packed});
}

void winograd_locate(const winograd_grid *g, int64_t first, int count, winograd_place *place)
{
    const int d = g->dilation;
    int x = (int)(first % g->columns);
    const int64_t line = first / g->columns;
    int column = (int)(line % d), row = (int)(line / d % d), /* of the interleaved image */
        y = (int)(line / (d * d) % g->rows), image = (int)(line / (d * d) / g->rows);
    for (int i = 0; i < count; i++) { /* without divisions, which would take a tenth of a small tile's time */
        place[i] = (winograd_place){image, y * g->side * d + row, x * g->side * d + column};
        if (++x < g->columns) continue;
        x = 0;
        if (++column < d) continue;
        column = 0;
        if (++row < d) continue;
        row = 0;
        if (++y < g->rows) continue;
        y = 0;
        image++;
    }
}

void winograd_sources(const winograd_grid *g, const float *x, int channels, const float *nothing, winograd_place at,
                      const float *pixel[WINOGRAD_AREA])
{
    ptrdiff_t row[WINOGRAD_REACH], column[WINOGRAD_REACH]; /* offsets; -1: outside */
    for (int a = 0; a < WINOGRAD_REACH; a++) {
        const int r = at.i + g->first_row + a * g->dilation, i = conv_clamp(r, g->h),
                  s = at.j + g->first_column + a * g->dilation, j = conv_clamp(s, g->w);
        row[a] = !g->replicate && i != r ? -1 : ((ptrdiff_t)at.image * g->h + i) * g->w * channels;
        column[a] = !g->replicate && j != s ? -1 : (ptrdiff_t)j * channels;
    }
    for (int a = 0; a < WINOGRAD_REACH; a++)
        for (int b = 0; b < WINOGRAD_REACH; b++)
            pixel[WINOGRAD_REACH * a + b] = row[a] < 0 || column[b] < 0 ? nothing : x + row[a] + column[b];
}

void winograd_targets(const winograd_grid *g, winograd_place at, ptrdiff_t pixel[WINOGRAD_OUTPUTS])
{
    for (int a = 0; a < g->side; a++) {
        const int i = at.i + a * g->dilation;
        for (int b = 0; b < g->side; b++) {
            const int j = at.j + b * g->dilation;
            pixel[g->side * a + b] = i < g->out_h && j < g->out_w
                ? (((ptrdiff_t)at.image * g->out_h + i) * g->out_w + j) * g->oc
                : -1;
        }
    }
}

/* m[36][tile][output] = v[36][tile][input] u[36][input][output] */
static void multiply(const winograd_grid *g, const float *u, const float *v, int count, float *m)
{
    const int panels = conv_panels(g->oc), step = ts_conv_k()->pixels, groups = (count + step - 1) / step;
    const int depth = depth_of(g->ic, g->bf16);
    const ptrdiff_t weights = conv_panels_count(depth, g->oc, 1), in = winograd_plane(TILES, depth),
                    out = winograd_plane(TILES, g->oc);
    const ts_segment segment = {0, 0, depth};
    ts_tile t = {.segment = &segment, .segments = 1, .a_stride = depth, .y_stride = g->oc, .leak = 1};
    for (int q = 0; q < WINOGRAD_AREA; q++)
        for (int panel = 0; panel < panels; panel++) {
            const int o0 = panel * 2 * conv_lanes(), vectors = conv_vectors(g->oc, panel);
            const ptrdiff_t size = (ptrdiff_t)depth * vectors * conv_lanes();
            t.w = u + q * weights + (ptrdiff_t)o0 * depth;
            t.channels = g->oc - o0;
            /* Each group fetches its part of the next panel, a half of it by each of two. */
            const float *next = q == WINOGRAD_AREA - 1 && panel == panels - 1 ? u : t.w + size;
            t.fetch_step[0] = t.fetch_step[1] = size * (ptrdiff_t)sizeof(float) / groups / 2 / ((depth + 3) / 4);
            for (int i = 0; i < groups; i++) {
                int begin, end;
                conv_part(count, groups, i, &begin, &end);
                t.fetch[0] = next + i * (size / groups);
                t.fetch[1] = t.fetch[0] + size / groups / 2;
                conv_run_tile(&t, vectors, v + q * in + (ptrdiff_t)begin * depth,
                              m + q * out + o0 + (ptrdiff_t)begin * g->oc, end - begin, g->bf16);
            }
        }
}

typedef struct run_job {
    const winograd_grid *g;
    const ts_conv_inputs *in;
    const float *packed;
    float leak;
    float *y;
    int constants; /* channels of in->constants */
    int step;      /* tiles of a task */
} run_job;

/* v [36][tile][depth] of channels that lie in an array of their own, plane numbers from one of the 36 to the next. */
static void transform(const winograd_grid *g, const float *x, int channels, const winograd_place *place, int count,
                      float *v, ptrdiff_t plane)
{
    const ts_winograd_form form = g->bf16 ? TS_WINOGRAD_CHANNELS : TS_WINOGRAD_F32;
    const int depth = depth_of(g->ic, g->bf16);
    float *nothing = ts_scratch(2, sizeof(float) * (size_t)channels);
    memset(nothing, 0, sizeof(float) * (size_t)channels);
    const float *from[2][WINOGRAD_AREA];
    winograd_sources(g, x, channels, nothing, place[0], from[0]);
    for (int i = 0; i < count; i++) {
        winograd_sources(g, x, channels, nothing, place[i + 1], from[(i + 1) & 1]);
        ts_winograd_k()->input[form](from[i & 1], from[(i + 1) & 1], channels, v + (ptrdiff_t)i * depth, plane);
    }
}

static void run_tiles(const void *job, int64_t group)
{
    const run_job *j = job;
    const winograd_grid *g = j->g;
    const int depth = depth_of(g->ic, g->bf16);
    const ptrdiff_t in = winograd_plane(TILES, depth), out = winograd_plane(TILES, g->oc);
    const int64_t first = group * j->step;
    const int count = (int)(g->tiles - first < j->step ? g->tiles - first : j->step);
    float *v = ts_scratch(0, sizeof(float) * (size_t)(in * WINOGRAD_AREA)),
          *m = ts_scratch(1, sizeof(float) * (size_t)(out * WINOGRAD_AREA));
    winograd_place place[TILES + 1];
    winograd_locate(g, first, count, place);
    place[count] = place[count - 1];
    const int channels = g->ic - j->constants;
    transform(g, j->in->x, channels, place, count, v, in);
    if (j->constants) /* behind whole pairs */
        transform(g, j->in->constants, j->constants, place, count, v + (g->bf16 ? channels / 2 : channels), in);
    multiply(g, j->packed, v, count, m);
    ptrdiff_t to[2][WINOGRAD_OUTPUTS];
    winograd_targets(g, place[0], to[0]);
    for (int i = 0; i < count; i++) {
        winograd_targets(g, place[i + 1], to[(i + 1) & 1]);
        ts_winograd_k()->output[g->side == 2][g->bf16](m + (ptrdiff_t)i * g->oc, out, g->oc, j->in->bias, j->in->base,
                                                       j->leak, j->y, to[i & 1], to[(i + 1) & 1]);
    }
}

static void run(const winograd_grid *g, const ts_conv_inputs *in, int constants, const float *packed, float leak,
                float *y)
{
    /* As many to each thread; a tile's values do not depend on those that it is computed with. */
    const int threads = ts_threads_of(g->threads);
    const int64_t groups = ((g->tiles + TILES - 1) / TILES + threads - 1) / threads * threads;
    const int step = (int)((g->tiles + groups - 1) / groups);
    ts_spread_tasks(g->threads, (g->tiles + step - 1) / step, run_tiles,
                    &(run_job){g, in, packed, leak, y, in->constants ? constants : 0, step});
}

void conv_winograd_forward(const ts_conv *c, bool bf16, const ts_conv_inputs *in, const float *packed, float leak,
                           float *y)
{
    const winograd_grid g = winograd_grid_forward(c, bf16);
    run(&g, in, c->constants, packed, leak, y);
}

typedef struct add_job {
    const ts_conv *c;
    winograd_part part;
    int channels;
    const float *from;
    float *dx;
} add_job;

/* What padding puts around the images gives its gradient to their borders. */
static void add_images(const void *job, int64_t begin, int64_t end)
{
    const add_job *j = job;
    const int w = j->c->w, channels = j->channels;
    for (int64_t image = begin; image < end; image++)
        for (int i = 0; i < j->part.h; i++) {
            const float *from = j->from + (image * j->part.h + i) * j->part.w * channels;
            float *row = j->dx + (image * j->c->h + conv_clamp(j->part.row + i, j->c->h)) * w * channels;
            for (int at = j->part.column, last = at + j->part.w, count; at < last; at += count) {
                count = at < 0 || at >= w ? 1 : (last < w ? last : w) - at;
                ts_elementwise_k()->copy(count, channels, from, channels, row + (ptrdiff_t)conv_clamp(at, w) * channels,
                                         channels, true);
                from += (ptrdiff_t)count * channels;
            }
        }
}

void conv_winograd_data_gradient(const ts_conv *c, bool bf16, const float *dy, const float *packed, float *dx,
                                 bool accumulate)
{
    winograd_grid g = winograd_grid_gradient(c, (winograd_part){0, 0, c->h, c->w}, bf16);
    run(&g, &(ts_conv_inputs){.x = dy, .base = accumulate ? dx : NULL}, 0, packed, 1, dx);
    if (c->pad != TS_PAD_REPLICATE) return;
    const int more = c->dilation * (c->k / 2), channels = ts_conv_variables(c);
    const winograd_part around[] = {{-more, -more, more, c->w + 2 * more},
                                    {c->h, -more, more, c->w + 2 * more},
                                    {0, -more, c->h, more},
                                    {0, c->w, c->h, more}};
    const int most = c->h > c->w + 2 * more ? c->h : c->w + 2 * more;
    float *part = ts_scratch(3, sizeof(float) * (size_t)c->n * (size_t)(most * more) * (size_t)channels);
    for (size_t i = 0; i < sizeof around / sizeof *around; i++) {
        g = winograd_grid_gradient(c, around[i], bf16);
        run(&g, &(ts_conv_inputs){.x = dy}, 0, packed, 1, part);
        ts_for(c->compute.threads, c->n, 1, add_images, &(add_job){c, around[i], channels, part, dx});
    }
}
