#include "nn/lattice.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    AROUND = 3, /* squares in each direction */
    ROWS = 4    /* of pixels at a time, at least */
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

/* sum [size][channels]: of the same place in the squares above and below row y. */
static void add_rows(const lattice_job *j, const float *from, int y, float *sum)
{
    const int row = j->size * j->channels;
    memset(sum, 0, (size_t)row * sizeof *sum);
    for (int at = y - AROUND * j->period; at <= y + AROUND * j->period; at += j->period) {
        if (at < 0 || at >= j->size) continue;
        const float *r = from + (size_t)at * (size_t)row;
        for (int i = 0; i < row; i++) sum[i] += r[i];
    }
}

/* The same of that, beside which sum has zeros on both sides. */
static void add_columns(const lattice_job *j, const float *sum, float *total)
{
    const int next = j->period * j->channels, row = j->size * j->channels;
    memset(total, 0, (size_t)row * sizeof *total);
    for (int k = -AROUND; k <= AROUND; k++)
        for (int i = 0; i < row; i++) total[i] += sum[i + k * next];
}

static void take_rows(const void *job, int64_t begin, int64_t end)
{
    const lattice_job *j = job;
    const int channels = j->channels, row = j->size * channels, beside = AROUND * j->period * channels;
    const size_t padded = (size_t)(row + 2 * beside);
    float *sum = ts_scratch(0, (padded + 2 * (size_t)row) * sizeof *sum), *weight = sum + padded,
          *weighted = weight + row;
    memset(sum, 0, padded * sizeof *sum);
    for (int y = (int)begin; y < (int)end; y++) {
        float *maps = j->maps + (size_t)y * (size_t)row;
        add_rows(j, j->weight, y, sum + beside);
        add_columns(j, sum + beside, weight);
        add_rows(j, j->weighted, y, sum + beside);
        add_columns(j, sum + beside, weighted);
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
        ts_for(threads, size, ROWS, take_rows, &job);
    } else code = ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    ts_arena_release(arena, mark);
    return code;
}
