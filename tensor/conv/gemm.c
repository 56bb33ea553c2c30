/* Matrix products with the tiles of the convolutions: rows of A are the pixels, B is packed as the weights. */
#include "tensor/conv/gemm.h"
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"

enum {
    ROWS = 8 * TS_TILE_PIXELS, /* of C in one unit of work */
    DEPTH = 1024               /* k in one go: a panel of B of this depth stays in the second cache */
};

/* A value of op(M), M stored with the given row length. */
static inline float value(const float *m, bool transposed, ptrdiff_t row_length, ptrdiff_t i, ptrdiff_t j)
{
    return transposed ? m[j * row_length + i] : m[i * row_length + j];
}

typedef struct pack_job {
    bool tb;
    int n, k, parts;
    float alpha;
    const float *b;
    float *packed;
} pack_job;

static void pack_part(const pack_job *p, int panel, int part)
{
    const int lanes = conv_lanes(), j0 = panel * 2 * lanes, width = conv_vectors(p->n, panel) * lanes,
              count = p->n - j0 < width ? p->n - j0 : width;
    int begin, end;
    conv_part(p->k, p->parts, part, &begin, &end);
    for (int i = begin; i < end; i++) {
        float *to = p->packed + (ptrdiff_t)j0 * p->k + (ptrdiff_t)i * width;
        for (int j = 0; j < count; j++) to[j] = p->alpha * value(p->b, p->tb, p->tb ? p->k : p->n, i, j0 + j);
        for (int j = count; j < width; j++) to[j] = 0;
    }
}

static void pack_parts(const void *job, int64_t begin, int64_t end)
{
    const pack_job *p = job;
    for (int64_t i = begin; i < end; i++) pack_part(p, (int)(i / p->parts), (int)(i % p->parts));
}

/* alpha op(B) as [panel][k][lane] */
static void pack_b(bool tb, int n, int k, float alpha, const float *b, float *packed, int threads)
{
    const int parts = k > 64 ? 16 : 1;
    ts_for(threads, (int64_t)conv_panels(n) * parts, 1, pack_parts, &(pack_job){tb, n, k, parts, alpha, b, packed});
}

typedef struct product {
    bool ta, scale;
    int m, n, k;
    const float *a, *packed;
    float beta, *c;
    int groups, panels;
} product;

/* Rows [row, row + rows) of C, k in [k0, k1), panels [panel0, panel1). */
static void run_part(const product *p, int row, int rows, int k0, int k1, int panel0, int panel1)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const float *a = p->a + (ptrdiff_t)row * p->k + k0;
    ptrdiff_t stride = p->k;
    if (p->ta) {
        stride = k1 - k0;
        float *copy = ts_scratch(1, sizeof(float) * (size_t)rows * (size_t)stride);
        for (int i = k0; i < k1; i++)
            for (int r = 0; r < rows; r++) copy[r * stride + i - k0] = p->a[(ptrdiff_t)i * p->m + row + r];
        a = copy;
    }
    for (int panel = panel0; panel < panel1; panel++) {
        const int j0 = panel * 2 * kernels->lanes, vectors = conv_vectors(p->n, panel);
        const ts_segment segment = {0, k0, k1 - k0};
        ts_tile t = {.segment = &segment,
                     .segments = 1,
                     .a_stride = stride,
                     .y_stride = p->n,
                     .w = p->packed + (ptrdiff_t)j0 * p->k,
                     .leak = 1,
                     .channels = p->n - j0,
                     .fetch = {p->packed, p->packed},
                     .add = k0 > 0 || p->beta != 0};
        if (k0 == 0 && p->scale)
            for (int r = 0; r < rows; r++)
                for (int j = j0; j < p->n && j < j0 + 2 * kernels->lanes; j++)
                    p->c[(ptrdiff_t)(row + r) * p->n + j] *= p->beta;
        for (int r = 0; r < rows; r += kernels->pixels) {
            const int count = rows - r < kernels->pixels ? rows - r : kernels->pixels;
            for (int g = 0; g < 3; g++) {
                const ptrdiff_t at = r + (g * TS_TILE_GROUP < count ? g * TS_TILE_GROUP : 0);
                t.a[g] = a + at * stride;
                t.y[g] = p->c + (row + at) * p->n + j0;
            }
            kernels->tile[vectors - 1][count](&t);
        }
    }
}

static void run_unit(const void *job, int64_t unit)
{
    const product *p = job;
    int panel0, panel1;
    conv_part(p->panels, p->groups, (int)(unit % p->groups), &panel0, &panel1);
    const int row = (int)(unit / p->groups) * ROWS, rows = p->m - row < ROWS ? p->m - row : ROWS;
    for (int k0 = 0; k0 < p->k; k0 += DEPTH)
        run_part(p, row, rows, k0, p->k - k0 < DEPTH ? p->k : k0 + DEPTH, panel0, panel1);
}

void ts_gemm(bool ta, bool tb, int m, int n, int k, float alpha, const float *a, const float *b, float beta, float *c,
             int threads)
{
    const int panels = conv_panels(n), units = (m + ROWS - 1) / ROWS;
    float *packed = ts_scratch(2, sizeof(float) * (size_t)k * (size_t)conv_whole(n));
    pack_b(tb, n, k, alpha, b, packed, threads);
    product p = {.ta = ta,
                 .scale = beta != 0 && beta != 1,
                 .m = m,
                 .n = n,
                 .k = k,
                 .a = a,
                 .packed = packed,
                 .beta = beta,
                 .c = c};
    int groups = units < 8 ? (8 + units - 1) / units : 1;
    if (groups > panels) groups = panels;
    p.panels = panels;
    p.groups = groups;
    ts_spread_tasks(threads, (int64_t)units * groups, run_unit, &p);
}

void ts_gemm_naive(bool ta, bool tb, int m, int n, int k, float alpha, const float *a, const float *b, float beta,
                   float *c)
{
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int l = 0; l < k; l++) sum += (double)value(a, ta, ta ? m : k, i, l) * value(b, tb, tb ? k : n, l, j);
            float *to = c + (ptrdiff_t)i * n + j;
            *to = (float)(alpha * sum + (beta != 0 ? beta * *to : 0));
        }
}
