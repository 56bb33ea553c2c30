/* Convolution of many inputs to few output channels, which alone would leave most lanes empty: of each input pixel the
 * products with all taps are made at once, as a kernel of side 1 to taps x outputs makes them, and added where they
 * belong (GEMM and col2im). */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    CHUNK_BYTES = 48 << 10, /* of products, which stay in the first cache until they are added */
    BANDS = 16,
    BAND_ROWS = 8
};

ptrdiff_t conv_col2im_count(int ic, int oc, int k) { return (ptrdiff_t)conv_whole(k * k * oc) * ic; }

/* [panel][input][lane]; lanes are [tap][output] */
void conv_pack_col2im(int ic, int oc, int k, bool mirrored, const float *weight, ptrdiff_t i_step, ptrdiff_t o_step,
                      float *packed)
{
    const int taps = k * k, lanes = taps * oc, panels = conv_panels(lanes);
    for (int panel = 0; panel < panels; panel++) {
        const int first = panel * 2 * conv_lanes(), width = conv_vectors(lanes, panel) * conv_lanes();
        for (int i = 0; i < ic; i++)
            for (int lane = first; lane < first + width; lane++) {
                const int t = lane / oc;
                *packed++ = lane < lanes ? weight[i * i_step + lane % oc * o_step + (mirrored ? taps - 1 - t : t)] : 0;
            }
    }
}

typedef struct job {
    const conv_plan *p;
    const struct ts_conv_kernels *kernels;
    conv_plan products; /* of some pixels: [pixel][lane] */
    int reach, vectors, chunks, bands;
    ptrdiff_t pixel, row; /* floats of a pixel's and a row's sums: whole vectors, whose lanes without a channel hold
                             something or other */
} job;

/* Output rows that are being summed. */
typedef struct sums {
    float *memory;
    int rows;
} sums;

static float *row_of(const job *g, const sums *s, int row) { return s->memory + row % s->rows * g->row; }

static void put_row(const job *g, float *sum, int image, int row)
{
    const conv_plan *p = g->p;
    g->kernels->finish(sum, p->w, p->oc, p->base != NULL, p->leak,
                       p->y + ((ptrdiff_t)image * p->h + row) * p->w * p->oc);
}

/* Output columns [begin, end) tap by tap: where borders are replicated, columns outside have the border's products, and
 * where the domain is folded, what belongs outside belongs to the border. */
static void add_edge(const job *g, const float *products, int left, int right, int begin, int end, float *sum)
{
    const conv_plan *p = g->p;
    for (int i = begin; i < end; i++)
        for (int t = 0; t < p->k; t++) {
            const int q = p->fold ? conv_clamp(i, p->w) : i, from = i - g->reach + t * p->dilation,
                      j = p->replicate ? conv_clamp(from, p->w) : from;
            if (q < 0 || q >= p->w || j < left || j >= right) continue;
            g->kernels->gather(products + (j - left) * (ptrdiff_t)g->products.oc + t * p->oc, 0, 1, 0, 1, g->vectors,
                               sum + q * g->pixel);
        }
}

/* Adds the products of input columns [left, right) with one row of the kernel to one row of output. */
static void add_columns(const job *g, const float *products, int left, int right, float *sum)
{
    const int begin = left - g->reach, end = right + g->reach;
    const bool wide = end - begin > 4 * g->reach; /* there are columns to which all taps add, and from here alone */
    const int inner = wide ? begin + 2 * g->reach : end, inner_end = wide ? end - 2 * g->reach : end;
    add_edge(g, products, left, right, begin, inner, sum);
    g->kernels->gather(products, g->products.oc, g->p->k, (ptrdiff_t)g->p->dilation * g->products.oc + g->p->oc,
                       inner_end - inner, g->vectors, sum + inner * g->pixel);
    add_edge(g, products, left, right, inner_end, end, sum);
}

/* Adds the products of input row r to all rows of output that it reaches. */
static void add_parts(const job *g, const sums *s, const float *products, int left, int right, int r)
{
    const conv_plan *p = g->p;
    const int above = p->replicate && r == 0 ? g->reach : 0, below = p->replicate && r == p->h - 1 ? g->reach : 0;
    for (int from = r - above; from <= r + below; from++)
        for (int ky = 0; ky < p->k; ky++) {
            int to = from + g->reach - ky * p->dilation;
            if (p->fold) to = conv_clamp(to, p->h);
            if (to >= 0 && to < p->h) add_columns(g, products + ky * p->k * p->oc, left, right, row_of(g, s, to));
        }
}

/* Of the image's input rows [begin, end), both edges of which may be inside of it: rows of output to which the band
 * above or below adds too go there. */
static void run_band(const job *g, int image, int begin, int end, float *above, float *below)
{
    const conv_plan *p = g->p;
    conv_plan products = g->products;
    const int panels = conv_panels(products.oc), reach = g->reach;
    sums s = {.rows = 2 * reach + 1};
    s.memory = ts_scratch(0, sizeof(float) * (size_t)(g->row * s.rows));
    products.y = ts_scratch(
        1,
        sizeof(float) *
            ((size_t)((p->w + g->chunks - 1) / g->chunks) * (size_t)products.oc + (size_t)g->kernels->lanes));
    const int first = begin > reach ? begin - reach : 0, last = end == p->h ? p->h : end + reach;
    for (int r = begin, next = first, done = first; r < end; r++) {
        for (; next <= r + reach && next < p->h; next++) memset(row_of(g, &s, next), 0, sizeof(float) * (size_t)g->row);
        for (int i = 0; i < g->chunks; i++) {
            int left, right;
            conv_part(p->w, g->chunks, i, &left, &right);
            products.x = p->x + (((ptrdiff_t)image * p->h + r) * p->w + left) * p->ic;
            conv_run_pixels(&products, 0, right - left, 0, panels);
            add_parts(g, &s, products.y, left, right, r);
        }
        for (; done < last && (done <= r - reach || r == end - 1); done++) {
            if (begin > 0 && done < begin + reach)
                memcpy(above + (done - first) * g->row, row_of(g, &s, done), sizeof(float) * (size_t)g->row);
            else if (end < p->h && done >= end - reach)
                memcpy(below + (done - end + reach) * g->row, row_of(g, &s, done), sizeof(float) * (size_t)g->row);
            else put_row(g, row_of(g, &s, done), image, done);
        }
    }
}

static job make_job(const conv_plan *p)
{
    const int lanes = conv_lanes(), tile = ts_conv_k()->pixels, taps = p->k * p->k, reach = p->k / 2 * p->dilation;
    job g = {.p = p,
             .kernels = ts_conv_k(),
             .reach = reach,
             .vectors = conv_whole(p->oc) / lanes,
             .pixel = conv_whole(p->oc)};
    g.row = p->w * g.pixel;
    g.products = (conv_plan){.ic = p->ic,
                             .channels = p->ic,
                             .oc = conv_whole(taps * p->oc),
                             .k = 1,
                             .dilation = 1,
                             .packed = p->packed + conv_panels_count(p->ic, p->oc, p->k),
                             .leak = 1};
    int wide = CHUNK_BYTES / (g.products.oc * (int)sizeof(float));
    if (wide < 4 * reach) wide = 4 * reach;
    wide = (wide + tile - 1) / tile * tile;
    g.chunks = (p->w + wide - 1) / wide;
    /* By shape alone, so that the sums do not depend on the number of threads; no row of output has more than two
     * bands. */
    const int least = 2 * reach > BAND_ROWS ? 2 * reach : BAND_ROWS, bands = p->h / least, most = BANDS / p->n;
    g.bands = bands < 1 || most < 1 ? 1 : bands < most ? bands : most;
    return g;
}

typedef struct run_job {
    const conv_plan *p;
    const job *g;
    float *shared; /* between a band and the next, of which each has a part */
    int rows;
    ptrdiff_t part;
} run_job;

static void run_unit(const void *made, int64_t unit)
{
    const run_job *r = made;
    const int i = (int)(unit % r->g->bands);
    float *below = r->shared + 2 * r->part * unit;
    int begin, end;
    conv_part(r->p->h, r->g->bands, i, &begin, &end);
    run_band(r->g, (int)(unit / r->g->bands), begin, end, i > 0 ? below - r->part : NULL, below);
}

static void add_shared(const void *made, int64_t from, int64_t to)
{
    const run_job *a = made;
    const job *g = a->g;
    for (int64_t at = from; at < to; at++) {
        const int r = (int)(at % a->rows), i = (int)(at / a->rows % (g->bands - 1)),
                  n = (int)(at / a->rows / (g->bands - 1));
        float *sum = a->shared + 2 * a->part * ((ptrdiff_t)n * g->bands + i) + r * g->row;
        int begin, end;
        conv_part(a->p->h, g->bands, i, &begin, &end);
        for (ptrdiff_t j = 0; j < g->row; j++) sum[j] += sum[j + a->part];
        put_row(g, sum, n, end - g->reach + r);
    }
}

void conv_run_col2im(const conv_plan *p)
{
    job g = make_job(p);
    const int rows = 2 * g.reach;
    const ptrdiff_t part = g.row * rows;
    float *shared = ts_scratch(
        2, sizeof(float) * ((size_t)(2 * part) * (size_t)p->n * (size_t)g.bands + (size_t)g.products.oc));
    if (p->bias) { /* each output has one product with the tap in the middle */
        float *bias = shared + 2 * part * p->n * g.bands;
        memset(bias, 0, sizeof(float) * (size_t)g.products.oc);
        memcpy(bias + p->k * p->k / 2 * p->oc, p->bias, sizeof(float) * (size_t)p->oc);
        g.products.bias = bias;
    }
    const run_job r = {p, &g, shared, rows, part};
    ts_spread_tasks(p->threads, (int64_t)p->n * g.bands, run_unit, &r);
    ts_for(p->threads, (int64_t)p->n * (g.bands - 1) * rows, 1, add_shared, &r);
}
