#include "nn/lattice.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    AROUND = 3, /* squares in each direction */
    ROWS = 4,   /* of pixels at a time, at least */
    STRIP = 64  /* numbers of a row that are summed over the rows at once */
};
#define FAINT 0.02f   /* s */
#define AGREEING 0.1f /* keeps the quotient small where hardly any pixel is as faint */

typedef struct lattice_job {
    int period, reach, size, channels;
    float *maps, *filtered, *weight, *weighted; /* [size][size][channels] each */
} lattice_job;

static int inside(int i, int size) { return i < 0 ? 0 : i < size ? i : size - 1; }

/* A mean over a whole period: the ends of an even one count half. */
static float tap(const lattice_job *j, int k)
{
    const bool half = j->period % 2 == 0 && (k == -j->reach || k == j->reach);
    return (half ? 0.5f : 1) / (float)j->period;
}

/* filtered: the mean of each column around. */
static void filter_rows(const void *job, int64_t begin, int64_t end)
{
    const lattice_job *j = job;
    const int row = j->size * j->channels;
    for (int y = (int)begin; y < (int)end; y++) {
        float *to = j->filtered + (size_t)y * (size_t)row;
        memset(to, 0, (size_t)row * sizeof *to);
        for (int k = -j->reach; k <= j->reach; k++) {
            const float *from = j->maps + (size_t)inside(y + k, j->size) * (size_t)row, part = tap(j, k);
            for (int i = 0; i < row; i++) to[i] += part * from[i];
        }
    }
}

/* Of the difference from the mean over rows of that, the weight and what it weighs; none where no whole period lies
 * around. */
static void weigh_rows(const void *job, int64_t begin, int64_t end)
{
    const lattice_job *j = job;
    const int channels = j->channels, row = j->size * channels, edge = j->reach * channels;
    for (int y = (int)begin; y < (int)end; y++) {
        const size_t at = (size_t)y * (size_t)row;
        const float *filtered = j->filtered + at, *own = j->maps + at;
        float *w = j->weight + at, *d = j->weighted + at;
        memset(w, 0, (size_t)row * sizeof *w);
        memset(d, 0, (size_t)row * sizeof *d);
        if (y < j->reach || y >= j->size - j->reach) continue;
        for (int k = -j->reach; k <= j->reach; k++) {
            const float part = tap(j, k);
            for (int i = edge; i < row - edge; i++) d[i] += part * filtered[i + k * channels];
        }
        for (int i = edge; i < row - edge; i++) {
            const float differ = own[i] - d[i], far = differ * (1 / FAINT), part = 1 / (1 + far * far);
            w[i] = part * part;
            d[i] = w[i] * differ;
        }
    }
}

/* Squares around it in a row of them. */
static int around(const lattice_job *j, int i)
{
    const int before = i / j->period, after = (j->size - 1 - i) / j->period;
    return 1 + (before < AROUND ? before : AROUND) + (after < AROUND ? after : AROUND);
}

/* from: count pieces of width numbers; to, stride numbers apart: for each the sum over those AROUND before to AROUND
 * after it that there are. Each is the last one, with one more and one less: always in this order, so that no value
 * depends on threads. sum [width] is overwritten. */
static void sum_around(const float *from, int count, int width, float *sum, float *to, size_t stride)
{
    memset(sum, 0, (size_t)width * sizeof *sum);
    for (int k = 0; k < AROUND && k < count; k++)
        for (int i = 0; i < width; i++) sum[i] += from[k * width + i];
    for (int k = 0; k < count; k++) {
        const float *more = from + (k + AROUND) * width, *less = from + (k - AROUND - 1) * width;
        if (k + AROUND < count)
            for (int i = 0; i < width; i++) sum[i] += more[i];
        if (k > AROUND)
            for (int i = 0; i < width; i++) sum[i] -= less[i];
        memcpy(to + (size_t)k * stride, sum, (size_t)width * sizeof *sum);
    }
}

/* Of numbers begin to end - 1 of each row: those at the same place of the squares above and below, summed in place. */
static void sum_columns(const lattice_job *j, float *v, int begin, int end)
{
    const int width = end - begin, most = (j->size + j->period - 1) / j->period;
    const size_t row = (size_t)j->size * (size_t)j->channels;
    float *copy = ts_scratch(0, (size_t)(width * (most + 1)) * sizeof *copy), *sum = copy + width * most;
    for (int y = 0; y < j->period && y < j->size; y++) {
        const int count = (j->size - y + j->period - 1) / j->period;
        float *first = v + (size_t)y * row + begin;
        for (int k = 0; k < count; k++)
            memcpy(copy + k * width, first + (size_t)(k * j->period) * row, (size_t)width * sizeof *copy);
        sum_around(copy, count, width, sum, first, (size_t)j->period * row);
    }
}

static void sum_strip(const void *job, int64_t i)
{
    const lattice_job *j = job;
    const int row = j->size * j->channels, begin = (int)i * STRIP, end = begin + STRIP < row ? begin + STRIP : row;
    sum_columns(j, j->weight, begin, end);
    sum_columns(j, j->weighted, begin, end);
}

/* The same of a row's squares; copy and to have room for a square more. */
static void sum_row(const lattice_job *j, const float *row, float *copy, float *sum, float *to)
{
    const int next = j->period * j->channels, count = (j->size + j->period - 1) / j->period;
    const size_t numbers = (size_t)j->size * (size_t)j->channels;
    memset(copy + (count - 1) * next, 0, (size_t)next * sizeof *copy);
    memcpy(copy, row, numbers * sizeof *copy);
    sum_around(copy, count, next, sum, to, (size_t)next);
}

static void take_rows(const void *job, int64_t begin, int64_t end)
{
    const lattice_job *j = job;
    const int channels = j->channels, next = j->period * channels;
    const size_t row = (size_t)j->size * (size_t)channels, padded = row + (size_t)next;
    float *weight = ts_scratch(0, (3 * padded + (size_t)next) * sizeof *weight), *weighted = weight + padded,
          *copy = weighted + padded, *sum = copy + padded;
    for (int y = (int)begin; y < (int)end; y++) {
        float *maps = j->maps + (size_t)y * row;
        sum_row(j, j->weight + (size_t)y * row, copy, sum, weight);
        sum_row(j, j->weighted + (size_t)y * row, copy, sum, weighted);
        for (int x = 0; x < j->size; x++) {
            const float least = AGREEING * (float)(around(j, y) * around(j, x));
            for (int i = x * channels; i < (x + 1) * channels; i++) maps[i] -= weighted[i] / (weight[i] + least);
        }
    }
}

ts_code nn_take_lattice(int period, int size, int channels, int threads, ts_arena *arena, float *maps, ts_status *st)
{
    const size_t bytes = (size_t)size * (size_t)size * (size_t)channels * sizeof(float);
    const ts_mark mark = ts_arena_mark(arena);
    const lattice_job job = {period,
                             period / 2,
                             size,
                             channels,
                             maps,
                             ts_arena_alloc(arena, bytes),
                             ts_arena_alloc(arena, bytes),
                             ts_arena_alloc(arena, bytes)};
    ts_code code = TS_OK;
    if (job.filtered && job.weight && job.weighted) {
        ts_for(threads, size, ROWS, filter_rows, &job);
        ts_for(threads, size, ROWS, weigh_rows, &job);
        ts_tasks(threads, (size * channels + STRIP - 1) / STRIP, sum_strip, &job);
        ts_for(threads, size, ROWS, take_rows, &job);
    } else code = ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    ts_arena_release(arena, mark);
    return code;
}
