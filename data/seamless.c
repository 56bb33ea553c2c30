#include "data/seamless.h"
#include "tensor/team.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { C = MAP_CHANNELS };

/* Maps [.][C] that are folded along one axis, of n pixels, m of them across. */
typedef struct axis {
    int n, m, overlap, threads;
    size_t along, across; /* from a pixel to the next, in pixels */
    bool closed;          /* the first across is the neighbour of the last */
} axis;

static const float *pixel(const float *maps, const axis *a, int x, int y)
{
    return maps + ((size_t)x * a->along + (size_t)y * a->across) * C;
}

typedef struct difference_job {
    const float *in;
    const axis *a;
    float *cost;
} difference_job;

static void difference_rows(const void *job, int64_t begin, int64_t end)
{
    const difference_job *j = job;
    const axis *a = j->a;
    for (int64_t y = begin; y < end; y++)
        for (int x = 0; x < a->overlap; x++) {
            const float *p = pixel(j->in, a, x, (int)y), *q = pixel(j->in, a, x + a->n - a->overlap, (int)y);
            float sum = 0;
            for (int c = 0; c < C; c++) sum += (p[c] - q[c]) * (p[c] - q[c]);
            j->cost[(size_t)y * (size_t)a->overlap + (size_t)x] = sum;
        }
}

/* cost [m][overlap]: how far the two that lie over each other differ. */
static void differences(const float *in, const axis *a, float *cost)
{
    ts_for(a->threads, a->m, 1, difference_rows, &(difference_job){in, a, cost});
}

/* The cheapest path through rows first .. first + count - 1 (modulo m) that moves at most one column a row. from: the
 * column of the first row and of the last one's, or -1: any. sum [count][overlap] is scratch. */
static void path(const float *cost, const axis *a, int first, int count, int from, float *sum, int *cut)
{
    const int w = a->overlap;
    for (int i = 0; i < count; i++)
        for (int x = 0; x < w; x++) {
            const float own = cost[(size_t)((first + i) % a->m) * (size_t)w + (size_t)x];
            float best = i ? INFINITY : from < 0 || x == from ? 0 : INFINITY;
            for (int d = -1; i && d <= 1; d++)
                if (x + d >= 0 && x + d < w) best = fminf(best, sum[(size_t)(i - 1) * (size_t)w + (size_t)(x + d)]);
            sum[(size_t)i * (size_t)w + (size_t)x] = best + own;
        }
    const float *last = sum + (size_t)(count - 1) * (size_t)w;
    int x = from < 0 ? 0 : from;
    for (int k = 1; k < w && from < 0; k++)
        if (last[k] < last[x]) x = k;
    for (int i = count - 1; i >= 0; i--) {
        cut[i] = x;
        int best = x;
        for (int d = -1; i && d <= 1; d++)
            if (x + d >= 0 && x + d < w &&
                sum[(size_t)(i - 1) * (size_t)w + (size_t)(x + d)] < sum[(size_t)(i - 1) * (size_t)w + (size_t)best])
                best = x + d;
        x = best;
    }
}

/* cut[y]: from this column on the first of the two is taken. */
static bool find_cut(const float *in, const axis *a, int *cut)
{
    const size_t cells = (size_t)a->m * (size_t)a->overlap;
    float *cost = malloc(cells * sizeof *cost), *sum = malloc(2 * cells * sizeof *sum);
    int *columns = malloc(2 * (size_t)a->m * sizeof *columns);
    const bool memory = cost && sum && columns;
    if (memory) {
        const int middle = a->closed ? a->m / 2 : 0;
        differences(in, a, cost);
        path(cost, a, 0, a->closed ? 2 * a->m : a->m, -1, sum, columns);
        /* a closed one begins and ends where an open one settles */
        if (a->closed) path(cost, a, middle, a->m, columns[middle], sum, columns);
        for (int i = 0; i < a->m; i++) cut[(middle + i) % a->m] = columns[i];
    }
    free(cost);
    free(sum);
    free(columns);
    return memory;
}

/* The index in 0 .. count - 1 that stands for i. */
static size_t within(int i, int count, bool closed)
{
    if (closed) return (size_t)(((i % count) + count) % count);
    return (size_t)(i < 0 ? 0 : i >= count ? count - 1 : i);
}

/* The mean of 2 r + 1 values along a line of count whose pixels lie step apart. */
static void box(const float *from, size_t step, int count, int r, bool closed, float *to)
{
    for (size_t c = 0; c < C; c++) {
        double sum = 0;
        for (int k = -r; k <= r; k++) sum += (double)from[within(k, count, closed) * step * C + c];
        for (int i = 0; i < count; i++) {
            to[(size_t)i * step * C + c] = (float)(sum / (2 * r + 1));
            sum += (double)from[within(i + r + 1, count, closed) * step * C + c] -
                (double)from[within(i - r, count, closed) * step * C + c];
        }
    }
}

typedef struct coarse_job {
    const float *in;
    const axis *a;
    int first, width, r;
    float *other, *low;
} coarse_job;

static void box_rows(const void *job, int64_t begin, int64_t end)
{
    const coarse_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const size_t at = (size_t)y * (size_t)j->width * C;
        float *line = j->low + at;
        for (int x = 0; x < j->width; x++)
            memcpy(line + (size_t)x * C, pixel(j->in, j->a, j->first + x, (int)y), C * sizeof *line);
        box(line, 1, j->width, j->r, false, j->other + at);
    }
}

static void box_columns(const void *job, int64_t begin, int64_t end)
{
    const coarse_job *j = job;
    for (int64_t x = begin; x < end; x++)
        box(j->other + (size_t)x * C, (size_t)j->width, j->a->m, j->r, j->a->closed, j->low + (size_t)x * C);
}

/* low [m][width][C]: the coarse part of columns first .. first + width - 1; other is as large. */
static void coarse(const float *in, const axis *a, int first, int width, float *other, float *low)
{
    const coarse_job j = {in, a, first, width, a->overlap / 4 > 0 ? a->overlap / 4 : 1, other, low};
    ts_for(a->threads, a->m, 1, box_rows, &j);
    ts_for(a->threads, width, 1, box_columns, &j);
}

typedef struct fold_job {
    const float *in, *low, *high;
    const axis *a, *to;
    const int *cut;
    int margin;
    float *out;
} fold_job;

static void fold_rows(const void *job, int64_t begin, int64_t end)
{
    const fold_job *j = job;
    const axis *a = j->a;
    const int kept = a->n - a->overlap, w = a->overlap, width = w + j->margin;
    for (int64_t row = begin; row < end; row++)
        for (int x = 0, y = (int)row; x < kept; x++) {
            const float *p = pixel(j->in, a, x, y);
            float *o = (float *)(uintptr_t)pixel(j->out, j->to, x, y);
            memcpy(o, p, C * sizeof *o);
            if (x >= w) continue;
            const float *q = pixel(j->in, a, x + kept, y), t = ((float)x + 0.5f) / (float)w,
                        share = t * t * (3 - 2 * t);
            const float *lp = j->low + ((size_t)y * (size_t)width + (size_t)x) * C,
                        *lq = j->high + ((size_t)y * (size_t)width + (size_t)(x + j->margin)) * C;
            for (int c = 0; c < C; c++)
                o[c] = share * lp[c] + (1 - share) * lq[c] + (x >= j->cut[y] ? p[c] - lp[c] : q[c] - lq[c]);
        }
}

/* out: n - overlap pixels along the axis, laid out [along][m] or [m][along] as the axis of out says. */
static bool fold(const float *in, const axis *a, const axis *to, float *out)
{
    const int kept = a->n - a->overlap, w = a->overlap, margin = w / 4 + 1, width = w + margin;
    const size_t strip = (size_t)width * (size_t)a->m * C;
    int *cut = malloc((size_t)a->m * sizeof *cut);
    float *memory = malloc(3 * strip * sizeof *memory), *low = memory, *high = memory + strip;
    const bool fine = cut && memory && find_cut(in, a, cut);
    if (fine) {
        coarse(in, a, 0, width, memory + 2 * strip, low);
        coarse(in, a, kept - margin, width, memory + 2 * strip, high);
        ts_for(a->threads, a->m, 1, fold_rows, &(fold_job){in, low, high, a, to, cut, margin, out});
    }
    free(cut);
    free(memory);
    return fine;
}

/* Catmull and Rom's cubic through four neighbours, t of the way from b to c. */
static float cubic(float a, float b, float c, float d, float t)
{
    return b + 0.5f * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

/* Of maps [n][n] that repeat, the line (column, or row where rows is true) that the border goes through: there the
 * neighbours differ little, and so do their heights, whose step is the normal's slope. Each over its mean, the larger
 * of the two is least. -1: out of memory. */
static int calmest(const float *maps, int n, bool rows)
{
    const size_t along = rows ? (size_t)n : 1, across = rows ? 1 : (size_t)n;
    const int normal = MAP_NORMAL + rows;
    double *sum = calloc(2 * (size_t)n, sizeof *sum), mean[2] = {0}, least = INFINITY;
    int best = -1;
    for (int i = 0; i < n && sum; i++)
        for (int j = 0; j < n; j++) {
            const float *a = maps + ((size_t)((i + 1) % n) * along + (size_t)j * across) * C,
                        *b = maps + ((size_t)((i + n - 1) % n) * along + (size_t)j * across) * C,
                        *here = maps + ((size_t)i * along + (size_t)j * across) * C;
            const io_texel t = io_texel_get(here);
            const double slope = (double)here[normal] / fmax((double)t.normal[2], 0.05);
            for (int c = 0; c < C; c++) sum[2 * i] += (double)((a[c] - b[c]) * (a[c] - b[c]));
            sum[2 * i + 1] += slope * slope;
        }
    for (int i = 0; i < 2 * n && sum; i++) mean[i % 2] += sum[i] / n;
    for (int i = 0; i < n && sum; i++) {
        double worse = 0;
        for (int k = 0; k < 2; k++)
            if (mean[k] > 0) worse = fmax(worse, sum[2 * i + k] / mean[k]);
        if (worse < least) least = worse, best = i;
    }
    free(sum);
    return best;
}

typedef struct resample_job {
    const float *from;
    float *to;
    int n, begin, size, lines;
    size_t step, line_in, line_out;
} resample_job;

static void resample_columns(const void *job, int64_t begin, int64_t end)
{
    const resample_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        const float u = ((float)i + 0.5f) * (float)j->n / (float)j->size;
        const int below = (int)floorf(u), first = below + j->begin;
        const float t = u - (float)below;
        for (int l = 0; l < j->lines; l++) {
            const float *v[4];
            for (int k = 0; k < 4; k++)
                v[k] = j->from + (within(first + k - 1, j->n, true) * j->step + (size_t)l * j->line_in) * C;
            for (int c = 0; c < C; c++)
                j->to[((size_t)i * j->step + (size_t)l * j->line_out) * C + (size_t)c] = cubic(v[0][c], v[1][c],
                                                                                               v[2][c], v[3][c], t);
        }
    }
}

/* in [n][n] that repeats to out [size][size], beginning in the middle of column begin[0] and row begin[1]; between
 * [n][size] is scratch. */
static void resample(const float *in, int n, const int begin[2], int size, int threads, float *between, float *out)
{
    for (int pass = 0; pass < 2; pass++) {
        const resample_job j = {pass ? between : in,
                                pass ? out : between,
                                n,
                                begin[pass],
                                size,
                                pass ? size : n,
                                pass ? (size_t)size : 1,
                                pass ? 1 : (size_t)n,
                                pass ? 1 : (size_t)size};
        ts_for(threads, size, 1, resample_columns, &j);
    }
}

ts_code io_seamless(const io_material *in, io_material *out, int threads, ts_status *st)
{
    const int n = in->size, overlap = n / IO_SEAMLESS_PART, kept = n - overlap;
    *out = (io_material){0};
    if (n < IO_SEAMLESS_LEAST)
        return ts_fail(st, TS_INVALID, "maps of %d x %d pixels are too small to be made seamless: %d at least", n, n,
                       IO_SEAMLESS_LEAST);
    const axis columns = {n, n, overlap, threads, 1, (size_t)n, false}, left = {kept, n, 0, 0, 1, (size_t)kept, false};
    const axis rows = {n, kept, overlap, threads, (size_t)kept, 1, true},
               up = {kept, kept, 0, 0, (size_t)kept, 1, true};
    float *a = malloc((size_t)n * (size_t)kept * C * sizeof *a),
          *b = malloc((size_t)kept * (size_t)kept * C * sizeof *b);
    ts_code code = io_material_create(out, n, st);
    if (!code && !(a && b && fold(in->maps, &columns, &left, a) && fold(a, &rows, &up, b)))
        code = ts_fail(st, TS_NOMEM, "no memory for seamless maps of %d x %d pixels", n, n);
    if (!code) {
        const int begin[2] = {calmest(b, kept, false), calmest(b, kept, true)};
        if (begin[0] < 0 || begin[1] < 0) code = ts_fail(st, TS_NOMEM, "no memory for %d lines", kept);
        else resample(b, kept, begin, n, threads, a, out->maps);
        memcpy(out->name, in->name, sizeof out->name);
        for (size_t i = 0; i < (size_t)n * (size_t)n; i++) { /* to what maps can say */
            const io_texel t = io_texel_get(out->maps + i * C);
            io_texel_put(out->maps + i * C, &t);
        }
    }
    free(a);
    free(b);
    if (code) io_material_free(out);
    return code;
}
