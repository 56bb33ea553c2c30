/* Convolutions of bf16 by the matrix unit (tensor/kernels/amx_conv.h). A band of rows is rounded into a window with its
 * halo, where all its pixels are one line: what tap (ky, kx) reads for pixel q of the line is pixel q + ky d columns +
 * kx d, wherever the rows end. So any 32 pixels in a run are rows of one product of matrices, however narrow the image;
 * those that fall on the halo's columns are computed and thrown away. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/amx_conv.h"
#include "tensor/kernels/pairs.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    WINDOW_FLOATS = 96 << 10, /* a window that leaves most of the second cache to weights */
    PART_FLOATS = 64 << 10,
    UNITS = 8 /* of work, at least, where the shape allows */
};

bool conv_amx_present(void) { return ts_amx_k()->product[0][0] != NULL; }

/* Undilated, the taps of a kernel row are neighbours in the window and are summed in one run. */
static bool merged(int dilation) { return dilation == 1; }

/* Steps of one kernel row. */
static int row_steps(int ic, int k, int dilation)
{
    return merged(dilation) ? (k * ic + TS_AMX_PAIRS - 1) / TS_AMX_PAIRS : k * ((ic + TS_AMX_PAIRS - 1) / TS_AMX_PAIRS);
}

static int panels_of(int oc) { return (oc + TS_AMX_BLOCK - 1) / TS_AMX_BLOCK; }

/* packed: [panel of 32 outputs][ky][step][pair of inputs][output], zeros where there is none */
enum { STEP_FLOATS = TS_AMX_PAIRS * TS_AMX_BLOCK };

size_t conv_amx_count(int ic, int oc, int k, int dilation)
{
    return (size_t)panels_of(oc) * (size_t)(k * row_steps(conv_bf16_depth(ic), k, dilation)) * STEP_FLOATS;
}

typedef struct pack_job {
    bool forward;
    int k, ic, oc, depth, steps, run, run_steps;
    ptrdiff_t o_step, i_step;
    const float *weight;
    float *packed;
} pack_job;

static void pack_row(const pack_job *j, int panel, int row)
{
    float pair[2 * STEP_FLOATS] = {0};
    const int taps = j->k * j->k, ky = row / j->steps, o0 = panel * TS_AMX_BLOCK,
              count = j->oc - o0 < TS_AMX_BLOCK ? j->oc - o0 : TS_AMX_BLOCK;
    for (int i = 0; i < TS_AMX_PAIRS; i++) {
        const int at = row % j->steps % j->run_steps * TS_AMX_PAIRS + i,
                  kx = row % j->steps / j->run_steps + at / j->depth, first = 2 * (at % j->depth);
        if (at >= j->run) break;
        const int tap = j->forward ? ky * j->k + kx : taps - 1 - (ky * j->k + kx);
        for (int half = 0; half < 2 && first + half < j->ic; half++) {
            const float *from = j->weight + (first + half) * j->i_step + o0 * j->o_step + tap;
            for (int o = 0; o < count; o++) pair[2 * (i * TS_AMX_BLOCK + o) + half] = from[o * j->o_step];
        }
    }
    ts_pairs_k()->of_channels(pair, 1, 2 * STEP_FLOATS,
                              j->packed + ((ptrdiff_t)panel * j->k * j->steps + row) * STEP_FLOATS, STEP_FLOATS);
}

static void pack_rows(const void *job, int64_t begin, int64_t end)
{
    const pack_job *j = job;
    for (int64_t i = begin; i < end; i++) pack_row(j, (int)(i / (j->k * j->steps)), (int)(i % (j->k * j->steps)));
}

void conv_amx_pack(const ts_conv *c, bool forward, const float *weight, float *packed)
{
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), k = c->k, taps = k * k,
              depth = conv_bf16_depth(ic);
    const ptrdiff_t o_step = forward ? (ptrdiff_t)c->ic * taps : taps,
                    i_step = forward ? taps : (ptrdiff_t)c->ic * taps;
    const int steps = row_steps(depth, k, c->dilation), panels = panels_of(oc);
    const int run = merged(c->dilation) ? k * depth : depth,
              run_steps = (run + TS_AMX_PAIRS - 1) / TS_AMX_PAIRS; /* pairs without a gap, and their steps */
    ts_for(c->compute.threads, (int64_t)panels * k * steps, 1, pack_rows,
           &(pack_job){forward, k, ic, oc, depth, steps, run, run_steps, o_step, i_step, weight, packed});
}

/* Pixels [0, count) of a line into y, whose row holds the first columns of every so many of them. window: readable 32
 * pixels and 32 channels beyond. */
typedef struct line {
    const conv_plan *p;
    const float *window;
    const ptrdiff_t *at;
    int steps, count, columns, inside; /* pixels; of a row; of those that exist */
} line;

/* What becomes of 32 channels of some pixels of a row. */
static void put(const conv_plan *p, const float *sums, int pixels, int channels, const float *bias, float *y,
                int column)
{
    const struct ts_amx_kernels *k = ts_amx_k();
    if (!p->fold) {
        float *to = y + (ptrdiff_t)column * p->oc;
        k->finish(sums, TS_AMX_BLOCK, pixels, channels, bias, p->base ? p->base + (to - p->y) : NULL, p->leak, to,
                  p->oc);
        return;
    }
    for (int done = 0, run; done < pixels; done += run) { /* a run within the image, or one pixel beside it */
        const int at = column + done - p->fold, to = conv_clamp(at, p->w);
        run = at == to ? (pixels - done < p->w - at ? pixels - done : p->w - at) : 1;
        float *sum = y + (ptrdiff_t)to * p->oc;
        k->finish(sums + (ptrdiff_t)done * TS_AMX_BLOCK, TS_AMX_BLOCK, run, channels, NULL, sum, 1, sum, p->oc);
    }
}

/* Pixels [first, end) of the line. y_row: where a row's pixels go, from its number in the line. */
static void run_part(const line *l, int first, int end, int panel, float *const *y_row)
{
    const conv_plan *p = l->p;
    const struct ts_amx_kernels *k = ts_amx_k();
    const int o0 = panel * TS_AMX_BLOCK, channels = p->oc - o0 < TS_AMX_BLOCK ? p->oc - o0 : TS_AMX_BLOCK;
    float sums[TS_AMX_BLOCK * TS_AMX_BLOCK] __attribute__((aligned(64)));
    ts_amx_product m = {.b = p->packed + (ptrdiff_t)panel * l->steps * STEP_FLOATS,
                        .b_row = TS_AMX_BLOCK,
                        .a_at = l->at,
                        .a_row = p->ic * (ptrdiff_t)sizeof(float),
                        .steps = l->steps,
                        .c = sums,
                        .c_row = TS_AMX_BLOCK};
    for (int q = first; q < end; q += TS_AMX_BLOCK) {
        const int pixels = end - q < TS_AMX_BLOCK ? end - q : TS_AMX_BLOCK;
        m.a = l->window + (ptrdiff_t)q * p->ic;
        k->product[pixels > TS_AMX_SIDE][channels > TS_AMX_SIDE](&m);
        for (int i = 0, run; i < pixels; i += run) {
            const int row = (q + i) / l->columns, column = (q + i) % l->columns, left = l->columns - column,
                      exist = l->inside - column;
            run = pixels - i < left ? pixels - i : left;
            const int count = run < exist ? run : exist;
            if (count > 0)
                put(p, sums + i * TS_AMX_BLOCK, count, channels, p->bias ? p->bias + o0 : NULL, y_row[row] + o0,
                    column);
        }
    }
}

/* Panels [panel0, panel1) of parts whose output stays in the second cache meanwhile: memory would rather have whole
 * pixels. */
static void run_line(const line *l, int panel0, int panel1, float *const *y_row)
{
    const int part = PART_FLOATS / (l->p->oc * TS_AMX_BLOCK) * TS_AMX_BLOCK,
              step = part > TS_AMX_BLOCK ? part : TS_AMX_BLOCK;
    for (int q = 0; q < l->count; q += step)
        for (int panel = panel0; panel < panel1; panel++)
            run_part(l, q, l->count - q < step ? l->count : q + step, panel, y_row);
}

typedef struct frame {
    const conv_plan *p;
    int reach, columns, out_w; /* of the window; of the output's domain */
    int steps;
    const ptrdiff_t *at;
} frame;

/* Rows e0 + first to e1 - 1 + first + reach of an image, with their padding; then zeros, for what is read beyond. */
static void fill_window(const frame *f, int image, int e0, int e1, float *to)
{
    const conv_plan *p = f->p;
    const int left = p->first < 0 ? -p->first : 0, behind = f->columns - left - p->w;
    const ptrdiff_t row = (ptrdiff_t)f->columns * p->ic;
    for (int r = e0 + p->first; r < e1 + p->first + f->reach; r++, to += row) {
        const int source = conv_clamp(r, p->h);
        if (source != r && !p->replicate) {
            memset(to, 0, sizeof(float) * (size_t)row);
            continue;
        }
        const ptrdiff_t at = ((ptrdiff_t)image * p->h + source) * p->w;
        float *in = to + (ptrdiff_t)left * p->ic, *end = in + (ptrdiff_t)p->w * p->ic;
        conv_put_pixels(p, p->x + at * p->channels, p->w, in, p->ic);
        if (p->more) /* behind whole pairs */
            ts_pairs_k()->of_channels(p->more + at * p->constants, p->w, p->constants, in + p->channels / 2, p->ic);
        const size_t pixel = sizeof(float) * (size_t)p->ic;
        for (int j = 0; j < left; j++) {
            if (p->replicate) memcpy(to + (ptrdiff_t)j * p->ic, in, pixel);
            else memset(to + (ptrdiff_t)j * p->ic, 0, pixel);
        }
        for (int j = 0; j < behind; j++) {
            if (p->replicate) memcpy(end + (ptrdiff_t)j * p->ic, end - p->ic, pixel);
            else memset(end + (ptrdiff_t)j * p->ic, 0, pixel);
        }
    }
    memset(to, 0, sizeof(float) * (size_t)(TS_AMX_BLOCK * p->ic + TS_AMX_PAIRS));
}

static void run_band(const frame *f, int image, int begin, int end, int panel0, int panel1)
{
    const conv_plan *p = f->p;
    const int e0 = begin == 0 ? 0 : begin + p->fold, e1 = end == p->h ? p->h + 2 * p->fold : end + p->fold,
              rows = e1 - e0;
    const size_t pixels = (size_t)(rows + f->reach) * (size_t)f->columns + TS_AMX_BLOCK;
    float *window = ts_scratch(0, sizeof(float) * (pixels * (size_t)p->ic + TS_AMX_PAIRS));
    float **y_row = ts_scratch(1, sizeof(float *) * (size_t)rows);
    fill_window(f, image, e0, e1, window);
    for (int i = 0; i < rows; i++)
        y_row[i] = p->y + ((ptrdiff_t)image * p->h + conv_clamp(e0 + i - p->fold, p->h)) * p->w * p->oc;
    if (p->fold && !p->base) {
        const int o0 = panel0 * TS_AMX_BLOCK, o1 = panel1 * TS_AMX_BLOCK < p->oc ? panel1 * TS_AMX_BLOCK : p->oc;
        for (ptrdiff_t q = (ptrdiff_t)begin * p->w; q < (ptrdiff_t)end * p->w; q++)
            memset(p->y + ((ptrdiff_t)image * p->h * p->w + q) * p->oc + o0, 0, sizeof(float) * (size_t)(o1 - o0));
    }
    const line l = {p, window, f->at, f->steps, (rows - 1) * f->columns + f->out_w, f->columns, f->out_w};
    ts_amx_k()->begin();
    run_line(&l, panel0, panel1, y_row);
    ts_amx_k()->end();
}

/* Where the steps read, from a pixel of a window with so many columns. */
static void place_steps(const conv_plan *p, int columns, ptrdiff_t *at)
{
    const int steps = row_steps(p->ic, p->k, p->dilation), run_steps = merged(p->dilation) ? steps : steps / p->k;
    for (int ky = 0; ky < p->k; ky++)
        for (int s = 0; s < steps; s++)
            *at++ = (((ptrdiff_t)ky * columns + s / run_steps) * p->dilation * p->ic + s % run_steps * TS_AMX_PAIRS) *
                (ptrdiff_t)sizeof(float);
}

typedef struct run_job {
    const frame *f;
    int bands, groups, panels;
} run_job;

static void run_unit(const void *job, int64_t unit)
{
    const run_job *j = job;
    const conv_plan *p = j->f->p;
    const int g = (int)(unit % j->groups), i = (int)(unit / j->groups % j->bands);
    int begin, end, panel0, panel1;
    conv_part(p->h, j->bands, i, &begin, &end);
    conv_part(j->panels, j->groups, g, &panel0, &panel1);
    run_band(j->f, (int)(unit / j->groups / j->bands), begin, end, panel0, panel1);
}

void conv_run_amx(const conv_plan *p)
{
    frame f = {.p = p, .reach = (p->k - 1) * p->dilation, .out_w = p->w + 2 * p->fold};
    f.columns = f.out_w + f.reach;
    f.steps = p->k * row_steps(p->ic, p->k, p->dilation);
    ptrdiff_t *at = ts_scratch(2, sizeof *at * (size_t)f.steps);
    place_steps(p, f.columns, at);
    f.at = at;
    const int panels = panels_of(p->oc);
    int rows = (int)(WINDOW_FLOATS / ((ptrdiff_t)f.columns * p->ic)) - f.reach, least = f.reach > 4 ? f.reach : 4;
    if (rows < least) rows = least;
    int bands = (p->h + rows - 1) / rows;
    if (p->n * bands < UNITS) bands = (UNITS + p->n - 1) / p->n;
    if (bands > (p->h + least - 1) / least) bands = (p->h + least - 1) / least;
    int groups = p->n * bands < UNITS ? (UNITS + p->n * bands - 1) / (p->n * bands) : 1;
    if (groups > panels) groups = panels;
    ts_spread_tasks(p->threads, (int64_t)p->n * bands * groups, run_unit, &(run_job){&f, bands, groups, panels});
}

void conv_amx_pixels(const conv_plan *p, int count)
{
    const int steps = row_steps(p->ic, 1, 1);
    ptrdiff_t *at = ts_scratch(3, sizeof *at * (size_t)steps);
    place_steps(p, 1, at);
    conv_amx_steps(p, at, steps, count);
}

void conv_amx_steps(const conv_plan *p, const ptrdiff_t *at, int steps, int count)
{
    const line l = {p, p->x, at, steps, count, count, count};
    float *y = p->y;
    ts_amx_k()->begin();
    run_line(&l, 0, panels_of(p->oc), &y);
    ts_amx_k()->end();
}
