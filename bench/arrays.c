#include "bench/arrays.h"
#include "tensor/team.h"
#include <stdio.h>
#include <string.h>

enum { PART = 1 << 12, SUMS = 64 };

typedef struct reading {
    const float *from;
    int64_t count;
} reading;

static void read_parts(const void *made, int64_t first, int64_t last)
{
    const reading *r = made;
    const int64_t end = last * PART < r->count ? last * PART : r->count;
    float sum[SUMS] = {0};
    int64_t i = first * PART;
    for (; i + SUMS <= end; i += SUMS)
        for (int k = 0; k < SUMS; k++) sum[k] += r->from[i + k];
    for (; i < end; i++) sum[0] += r->from[i];
    for (int k = 1; k < SUMS; k++) sum[0] += sum[k];
    volatile float keep = sum[0]; /* or the loop would be removed */
    (void)keep;
}

typedef struct writing {
    float *to;
    int64_t count;
    bool adds;
} writing;

static void write_parts(const void *made, int64_t first, int64_t last)
{
    const writing *w = made;
    const int64_t end = last * PART < w->count ? last * PART : w->count;
    if (!w->adds) memset(w->to + first * PART, 0, sizeof(float) * (size_t)(end - first * PART));
    else
        for (int64_t i = first * PART; i < end; i++) w->to[i] += 1;
}

static void touch(void *user)
{
    const bench_arrays *a = user;
    for (int i = 0; i < 2; i++) {
        const reading r = {a->read[i], a->reads[i]};
        ts_for(0, (r.count + PART - 1) / PART, 1, read_parts, &r);
    }
    const writing w = {a->written, a->writes, a->adds};
    ts_for(0, (w.count + PART - 1) / PART, 1, write_parts, &w);
}

void bench_row_arrays(bench_time t, bench_arrays *a)
{
    const double alone = bench_measure(touch, a).seconds, share = alone / t.seconds;
    if (share < 0.1) return;
    printf("    to read and write its arrays alone takes %.4f ms, %.0f %% of that: %.1f GB/s\n", 1e3 * alone,
           100 * share,
           1e-9 * sizeof(float) * (double)(a->reads[0] + a->reads[1] + a->writes * (a->adds ? 2 : 1)) / alone);
    fflush(stdout);
}
