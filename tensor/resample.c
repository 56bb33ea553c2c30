#include "tensor/resample.h"
#include "tensor/kernels/resample.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <math.h>
#include <string.h>

static ts_taps make_taps(ts_arena *arena, int in, int out, size_t weights)
{
    ts_taps t = {.in = in, .out = out};
    t.first = ts_arena_alloc(arena, (size_t)out * sizeof(int));
    t.offset = ts_arena_zalloc(arena, (size_t)out + 1, sizeof(int));
    t.weight = t.first && t.offset ? ts_arena_zalloc(arena, weights, sizeof(float)) : NULL;
    return t;
}

ts_taps ts_taps_aligned(ts_arena *arena, int in, int out)
{
    ts_taps t = make_taps(arena, in, out, 2 * (size_t)out);
    if (!t.weight) return t;
    for (int j = 0, at = 0; j < out; j++) {
        /* in whole numbers, so that no rounding moves a position that falls on a source pixel */
        int64_t numerator = (int64_t)j * (in - 1), denominator = out > 1 ? out - 1 : 1;
        int i = (int)(numerator / denominator);
        float f = (float)((double)(numerator % denominator) / (double)denominator);
        t.first[j] = i;
        t.weight[at++] = 1.0f - f;
        if (f > 0) t.weight[at++] = f;
        t.offset[j + 1] = at;
    }
    return t;
}

static double triangle(double x) { return x < 1 ? 1 - x : 0; }

/* Mitchell and Netravali, Reconstruction filters in computer graphics, 1988, with B = .6, C = .2. */
static double cubic(double x)
{
    const double b = 0.6, c = 0.2;
    if (x < 1) return (12 - 9 * b - 6 * c) / 6 * x * x * x - (18 - 12 * b - 6 * c) / 6 * x * x + (6 - 2 * b) / 6;
    if (x < 2) return -(b + 6 * c) / 6 * x * x * x + (b + 5 * c) * x * x - (2 * b + 8 * c) * x + (8 * b + 24 * c) / 6;
    return 0;
}

/* weight is not 0 for distances below support, in units of scale. */
static ts_taps make_filter(ts_arena *arena, int in, int out, double scale, double support, double (*weight)(double))
{
    const double step = (double)in / out, radius = scale * support;
    const size_t most = 2 * (size_t)ceil(radius) + 1;
    ts_taps t = make_taps(arena, in, out, most * (size_t)out);
    if (!t.weight) return t;
    for (int j = 0, at = 0; j < out; j++) {
        const double centre = (j + 0.5) * step - 0.5;
        const int lo = (int)floor(centre - radius) + 1,
                  hi = (int)ceil(centre + radius) - 1; /* where there is a weight */
        const int from = lo < 0 ? 0 : lo, to = hi > in - 1 ? in - 1 : hi;
        double sum = 0;
        for (int i = lo; i <= hi; i++) sum += weight(fabs(i - centre) / scale);
        for (int i = from; i <= to; i++) {
            double w = weight(fabs(i - centre) / scale);
            if (i == 0)
                for (int q = lo; q < 0; q++) w += weight(fabs(q - centre) / scale);
            if (i == in - 1)
                for (int q = in; q <= hi; q++) w += weight(fabs(q - centre) / scale);
            t.weight[at + i - from] = (float)(w / sum);
        }
        t.first[j] = from;
        at += to - from + 1;
        t.offset[j + 1] = at;
    }
    return t;
}

ts_taps ts_taps_triangle(ts_arena *arena, int in, int out)
{
    return make_filter(arena, in, out, in > out ? (double)in / out : 1, 1, triangle);
}

ts_taps ts_taps_smooth(ts_arena *arena, int in, int out)
{
    return out > in ? make_filter(arena, in, out, 1, 2, cubic) : ts_taps_triangle(arena, in, out);
}

ts_taps ts_taps_transpose(ts_arena *arena, const ts_taps *t)
{
    /* Both ends of a row's taps grow with the row, so the rows that touch a position follow each other. */
    size_t weights = 0;
    for (int i = 0, lo = 0, hi = 0; i < t->in; i++) {
        while (lo < t->out && t->first[lo] + t->offset[lo + 1] - t->offset[lo] <= i) lo++;
        while (hi < t->out && t->first[hi] <= i) hi++;
        weights += hi > lo ? (size_t)(hi - lo) : 0;
    }
    ts_taps r = make_taps(arena, t->out, t->in, weights ? weights : 1);
    if (!r.weight) return r;
    for (int i = 0, lo = 0, hi = 0; i < t->in; i++) {
        while (lo < t->out && t->first[lo] + t->offset[lo + 1] - t->offset[lo] <= i) lo++;
        while (hi < t->out && t->first[hi] <= i) hi++;
        r.first[i] = lo;
        r.offset[i + 1] = r.offset[i] + (hi > lo ? hi - lo : 0);
        for (int j = lo; j < hi; j++) r.weight[r.offset[i] + j - lo] = t->weight[t->offset[j] + i - t->first[j]];
    }
    return r;
}

typedef struct resampling {
    int c;
    const ts_taps *rows, *columns;
    const float *x;
    float *y;
    bool accumulate, copies; /* columns are copied as they are */
} resampling;

static void resample_lines(const void *job, int64_t begin, int64_t end)
{
    const resampling *r = job;
    const struct ts_resample_kernels *k = ts_resample_k();
    const ts_taps *rows = r->rows, *columns = r->columns;
    const int64_t row = (int64_t)columns->in * r->c, image = row * rows->in;
    for (int64_t line = begin; line < end; line++) {
        const int j = (int)(line % rows->out), at = rows->offset[j], count = rows->offset[j + 1] - at;
        const float *from = r->x + line / rows->out * image + rows->first[j] * row;
        if (count != 1 || rows->weight[at] != 1.0f) {
            float *mixed = ts_scratch(0, (size_t)row * sizeof(float));
            k->rows(row, count, rows->weight + at, from, row, mixed);
            from = mixed;
        }
        float *to = r->y + line * columns->out * r->c;
        if (r->copies) memcpy(to, from + columns->first[0] * r->c, (size_t)(columns->out * r->c) * sizeof *to);
        else k->pixels(columns->out, r->c, columns->first, columns->offset, columns->weight, from, to, r->accumulate);
    }
}

/* Whether every position is that of one of its own, one after the other. */
static bool copies(const ts_taps *t)
{
    for (int i = 0; i < t->out; i++)
        if (t->offset[i + 1] - t->offset[i] != 1 || t->weight[t->offset[i]] != 1.0f || t->first[i] != t->first[0] + i)
            return false;
    return t->out > 0;
}

void ts_resample(int n, int c, const ts_taps *rows, const ts_taps *columns, const float *x, float *y, bool accumulate,
                 int threads)
{
    ts_for(threads, (int64_t)n * rows->out, 1, resample_lines,
           &(resampling){c, rows, columns, x, y, accumulate, !accumulate && copies(columns)});
}

bool ts_resample_transposed(ts_arena *arena, int n, int c, const ts_taps *rows, const ts_taps *columns, const float *x,
                            float *y, bool accumulate, int threads)
{
    if (!rows->weight || !columns->weight) return false;
    const ts_mark mark = ts_arena_mark(arena);
    const ts_taps up = ts_taps_transpose(arena, rows), left = ts_taps_transpose(arena, columns);
    const bool held = up.weight && left.weight;
    if (held) ts_resample(n, c, &up, &left, x, y, accumulate, threads);
    ts_arena_release(arena, mark);
    return held;
}
