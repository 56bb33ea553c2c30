#include "eval/metrics/filter.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

ev_taps ev_gauss_taps(double sigma, int radius)
{
    ev_taps t = {.radius = radius};
    double sum = 0;
    for (int i = -radius; i <= radius; i++) sum += t.tap[i + radius] = exp(-i * i / (2 * sigma * sigma));
    for (int i = 0; i <= 2 * radius; i++) t.tap[i] /= sum;
    return t;
}

static int nearest(int i, int n) { return i < 0 ? 0 : i >= n ? n - 1 : i; }

/* out[x] = sum_i tap[i] from[i][x]: a block of sums stays in registers over all taps. */
enum { BLOCK = 8 };
static void weigh(int w, int taps, const double *tap, const double *const *from, double *out)
{
    int x = 0;
    for (; x + BLOCK <= w; x += BLOCK) {
        double sum[BLOCK] = {0};
        for (int i = 0; i < taps; i++) {
            const double k = tap[i], *p = from[i] + x;
            for (int j = 0; j < BLOCK; j++) sum[j] += k * p[j];
        }
        memcpy(out + x, sum, sizeof sum);
    }
    for (; x < w; x++) {
        double sum = 0;
        for (int i = 0; i < taps; i++) sum += tap[i] * from[i][x];
        out[x] = sum;
    }
}

typedef struct filtering {
    int h, w;
    const double *in;
    const ev_taps *across, *down;
    double *work, *out;
} filtering;

static void filter_across(const void *job, int64_t begin, int64_t end)
{
    const filtering *f = job;
    const int r = f->across->radius, w = f->w;
    for (int64_t y = begin; y < end; y++) {
        const double *row = f->in + y * w, *from[2 * EV_TAPS_MAX + 1];
        double *padded = ts_scratch(0, ((size_t)w + 2 * EV_TAPS_MAX) * sizeof *padded);
        for (int x = 0; x < r; x++) padded[x] = row[0], padded[r + w + x] = row[w - 1];
        memcpy(padded + r, row, (size_t)w * sizeof *row);
        for (int i = 0; i <= 2 * r; i++) from[i] = padded + i;
        weigh(w, 2 * r + 1, f->across->tap, from, f->work + y * w);
    }
}

static void filter_down(const void *job, int64_t begin, int64_t end)
{
    const filtering *f = job;
    for (int64_t y = begin; y < end; y++) {
        const double *from[2 * EV_TAPS_MAX + 1];
        for (int j = 0; j <= 2 * f->down->radius; j++)
            from[j] = f->work + (int64_t)nearest((int)y + j - f->down->radius, f->h) * f->w;
        weigh(f->w, 2 * f->down->radius + 1, f->down->tap, from, f->out + y * f->w);
    }
}

void ev_filter(int h, int w, const double *in, const ev_taps *across, const ev_taps *down, double *work, double *out)
{
    const filtering f = {h, w, in, across, down, work, out};
    ts_for(0, h, 1, filter_across, &f);
    ts_for(0, h, 1, filter_down, &f);
}
