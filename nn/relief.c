#include "nn/relief.h"
#include "autograd/log_scale.h"
#include "nn/model.h"
#include "tensor/maps.h"
#include "tensor/resample.h"
#include "tensor/team.h"
#include <math.h>

enum { PARTS = 64, WORTH = 4096 }; /* of all pixels; pixels that another thread is worth */

typedef struct relief_job {
    int64_t pixels;
    int channels;
    const float *spread;
    float *maps, *slopes, *broad; /* [pixels][2] the last two: the slopes, and what cells show of them */
    float factor, more;           /* of the slopes, and by how much more of the broad ones */
    double *slope, *error;        /* [PARTS]: sums */
} relief_job;

static void sum_parts(const void *job, int64_t begin, int64_t end)
{
    const relief_job *j = job;
    for (int64_t part = begin; part < end; part++) {
        double slope = 0, error = 0;
        for (int64_t i = part * j->pixels / PARTS; i < (part + 1) * j->pixels / PARTS; i++) {
            const float *n = j->maps + i * j->channels + MAP_NORMAL;
            slope += (double)sqrtf(n[0] * n[0] + n[1] * n[1]);
            error += (double)(NN_SPREAD_UNIT * expf(ag_log_scale_held(j->spread[i * NN_SPREADS + GROUP_NORMAL])));
        }
        j->slope[part] = slope, j->error[part] = error;
    }
}

/* How much of the relief that g says there is, 0 to 1. */
static float sure_of(relief_job *j, int threads)
{
    double slopes[PARTS], errors[PARTS], slope = 0, error = 0;
    j->slope = slopes, j->error = errors;
    ts_for(threads, PARTS, WORTH * PARTS / (j->pixels + 1) + 1, sum_parts, j);
    for (int k = 0; k < PARTS; k++) slope += slopes[k], error += errors[k];
    const float shown = (float)(slope / fmax(error, 1e-30));
    return fminf(fmaxf((shown - NN_RELIEF_NONE) / (NN_RELIEF_SURE - NN_RELIEF_NONE), 0), 1);
}

/* n_x / n_z and n_y / n_z; those that are steeper than a normal of n_z = .1 count as that. */
static void slopes_of(const float *n, float slope[2])
{
    const float up = sqrtf(1 - fminf(n[0] * n[0] + n[1] * n[1], 0.99f));
    for (int k = 0; k < 2; k++) slope[k] = n[k] / up;
}

static void take_slopes(const void *job, int64_t begin, int64_t end)
{
    const relief_job *j = job;
    for (int64_t i = begin; i < end; i++) slopes_of(j->maps + i * j->channels + MAP_NORMAL, j->slopes + i * 2);
}

/* The slopes as cells show them: broad. */
static ts_code broaden(int side, int threads, ts_arena *arena, relief_job *j, ts_status *st)
{
    enum { CELLS = NN_RELIEF_CELLS };
    float *cells = ts_arena_alloc(arena, (size_t)(CELLS * CELLS * 2) * sizeof *cells);
    j->slopes = ts_arena_alloc(arena, (size_t)j->pixels * 2 * sizeof *j->slopes);
    j->broad = ts_arena_alloc(arena, (size_t)j->pixels * 2 * sizeof *j->broad);
    const ts_taps down = ts_taps_triangle(arena, side, CELLS), up = ts_taps_smooth(arena, CELLS, side);
    if (!cells || !j->slopes || !j->broad || !down.weight || !up.weight)
        return ts_fail(st, TS_NOMEM, "out of memory for the relief of %d x %d pixels", side, side);
    ts_for(threads, j->pixels, WORTH, take_slopes, j);
    ts_resample(1, 2, &down, &down, j->slopes, cells, false, threads);
    ts_resample(1, 2, &up, &up, cells, j->broad, false, threads);
    return TS_OK;
}

static void multiply(const void *job, int64_t begin, int64_t end)
{
    const relief_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        float *n = &j->maps[i * j->channels + MAP_NORMAL], slope[2];
        slopes_of(n, slope);
        for (int k = 0; k < 2; k++) slope[k] = slope[k] * j->factor + (j->broad ? j->broad[i * 2 + k] * j->more : 0);
        const float length = sqrtf(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        for (int k = 0; k < 2; k++) n[k] = slope[k] / length;
    }
}

ts_code nn_weigh_relief(int side, int channels, const float *spread, bool steeper, int threads, ts_arena *arena,
                        float *maps, ts_status *st)
{
    relief_job j = {.pixels = (int64_t)side * side, .channels = channels, .spread = spread, .maps = maps};
    j.factor = sure_of(&j, threads);
    if (j.factor == 1 && !steeper) return TS_OK;
    const ts_mark mark = ts_arena_mark(arena);
    ts_code code = TS_OK;
    if (steeper && j.factor > 0) {
        j.more = j.factor * (NN_RELIEF_BROAD - NN_RELIEF_FINE);
        j.factor *= NN_RELIEF_FINE;
        code = broaden(side, threads, arena, &j, st);
    }
    if (code == TS_OK) ts_for(threads, j.pixels, WORTH, multiply, &j);
    ts_arena_release(arena, mark);
    return code;
}
