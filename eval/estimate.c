#include "eval/estimate.h"
#include "cli/cli.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct watch {
    const ev_case *c;
    const int *step;
    int points, at;                  /* at: the next point */
    ev_row *row;                     /* NULL: only time */
    double *seconds, start, scoring; /* scoring: spent on scores so far */
    float *first, *last;
    bool finite, stopped;
} watch;

static bool seen(int step, const float *maps, int channels, void *user)
{
    watch *w = user;
    const double now = cl_seconds();
    w->stopped = cl_interrupted();
    if (w->stopped) return false;
    if (w->at == w->points || step != w->step[w->at]) return true;
    w->seconds[w->at] = now - w->start - w->scoring;
    if (w->row) {
        const int64_t pixels = (int64_t)w->c->size * w->c->size;
        ev_case c = *w->c;
        if (w->at != 0 && w->at != w->points - 1) c.perceptual = false, c.lpips = NULL;
        w->row[w->at] = ev_score(&c, maps, channels);
        const bool compared = c.truth || c.capture;
        w->finite = isfinite(w->row[w->at].value[compared ? EV_RENDER : EV_RELIEF]);
        for (int64_t i = 0; i < pixels * channels; i++)
            w->finite = w->finite && isfinite(maps[i]); /* a clamp may hide it from the scores */
        for (int copy = 0; copy < 2; copy++) {
            float *to = copy ? w->last : w->at == 0 ? w->first : NULL;
            for (int64_t i = 0; to && i < pixels; i++)
                memcpy(to + i * MAP_CHANNELS, maps + i * channels, MAP_CHANNELS * sizeof *to);
        }
        w->scoring += cl_seconds() - now;
    }
    w->at++;
    return w->finite;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

ts_code ev_estimate(ev_estimator *e, const ev_case *c, const int *step, int points, int repeat, ev_row *row,
                    double *seconds, float *first, float *last, ts_status *st)
{
    double *all = malloc((size_t)points * (size_t)repeat * sizeof *all),
           *sorted = malloc((size_t)repeat * sizeof *sorted);
    ts_code code = all && sorted ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for %d times", repeat);
    for (int r = 0; r < repeat && !code; r++) {
        watch w = {.c = c,
                   .step = step,
                   .points = points,
                   .row = r ? NULL : row,
                   .seconds = all + (size_t)r * (size_t)points,
                   .start = cl_seconds(),
                   .first = first,
                   .last = last,
                   .finite = true};
        code = e->method->run(e, c, seen, &w, st);
        if (w.stopped) code = ts_fail(st, TS_INTERRUPTED, "interrupted");
        else if (!code && !w.finite)
            code = ts_fail(st, TS_NUMERIC,
                           "the maps or their renderings have no finite error: damaged weights, too large a rate, or "
                           "out of memory");
    }
    for (int i = 0; i < points && !code; i++) {
        for (int r = 0; r < repeat; r++) sorted[r] = all[(size_t)r * (size_t)points + (size_t)i];
        qsort(sorted, (size_t)repeat, sizeof *sorted, by_size);
        seconds[i] = (sorted[repeat / 2] + sorted[(repeat - 1) / 2]) / 2;
    }
    free(all);
    free(sorted);
    return code;
}
