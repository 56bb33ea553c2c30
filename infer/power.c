#include "infer/power.h"
#include "nn/clip.h"
#include "render/render.h"
#include "tensor/team.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Stops by which R_0's brightness errs under the default light: the estimate is brought that much nearer to 1, so that
 * photographs under that light keep it. */
#define TOLERATED_STOPS 0.2
#define MOST_STOPS 3.0
#define COARSE_STOPS \
    0.4 /* first these, then the finer ones around the best of them, a quarter of what is left out anyway */
#define STEP_STOPS 0.05
enum { MOST_TRIED = 8 /* on either side of the middle */, PORTION = 256 };

/* How far the photographs' renderings are from them when every light is 2^stops times as strong: the loss of training,
 * which a few pixels in a highlight that is in another place do not decide; both as a camera clips them. Above enough
 * the sum ends: terms are not negative, so that it would only grow. */
static double distance(size_t values, const float *log_photo, const float *rendered, double stops, double enough)
{
    const float factor = (float)exp2(stops);
    double sum = 0;
    for (size_t from = 0; from < values && !(sum > enough); from += PORTION)
        for (size_t i = from; i < values && i < from + PORTION; i++) {
            const float bright = factor * rendered[i];
            sum += fabs((double)(log_photo[i] - logf((bright < 1 ? bright : 1) + 0.01f)));
        }
    return sum;
}

typedef struct search {
    size_t values;
    const float *log_photo, *rendered;
    double middle, step, at_middle, *far;
    int most;
} search;

static void try(const void *job, int64_t i)
{
    const search *s = job;
    s->far[i] = i == s->most
        ? s->at_middle
        : distance(s->values, s->log_photo, s->rendered, s->middle + ((int)i - s->most) * s->step, s->at_middle);
}

/* The stops around middle at which it is least. */
static double nearest(size_t values, const float *log_photo, const float *rendered, double middle, double reach,
                      double step, int threads)
{
    double far[2 * MOST_TRIED + 1];
    const int most = (int)lround(reach / step);
    int best = 0;
    const double at_middle = distance(values, log_photo, rendered, middle, INFINITY);
    ts_tasks(threads, 2 * most + 1, try, &(search){values, log_photo, rendered, middle, step, at_middle, far, most});
    for (int i = 1; i <= 2 * most; i++)
        if (far[i] < far[best]) best = i;
    return middle + (best - most) * step;
}

static ts_code fit(ag_tape *tape, const nn_model *model, const float *const *image, const rd_view *views, int given,
                   int side, int orientations, float *r0, double *factor, ts_status *st)
{
    const int size = nn_arch_side(&model->arch);
    const rd_grid grid = rd_grid_on(rd_grid_full(size), ag_compute(tape)->threads);
    const size_t values = (size_t)size * (size_t)size * 3;
    *factor = 1;
    ag_value *small = ag_empty(tape, (ts_shape){given, size, size, 3}),
             *rendered = ag_empty(tape, (ts_shape){given, size, size, 3});
    if (!small || !rendered) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    if (nn_clip_to(image, side, &small->t, ag_arena(tape), grid.threads, st)) return st->code;
    const nn_input in = {.image = small->t, .grid = grid, .views = views, .given = given, .orientations = orientations};
    const ag_value *maps = nn_predict(tape, model, &in);
    if (!maps) {
        *st = *ag_status(tape);
        return st->code;
    }
    memcpy(r0, maps->t.data, (size_t)ts_count(maps->t.shape) * sizeof(float));
    for (int k = 0; k < given; k++)
        rd_render(grid, maps->t.data, maps->t.shape.c, &views[k], false, rendered->t.data + (size_t)k * values);
    bool informative = false; /* black: any light would be too strong; clipped: none would be */
    for (size_t i = 0; i < (size_t)given * values && !informative; i++)
        informative = small->t.data[i] > 0 && small->t.data[i] < 1;
    if (!informative) return TS_OK;
    float *log_photo = small->t.data;
    for (size_t i = 0; i < (size_t)given * values; i++)
        log_photo[i] = logf((log_photo[i] < 1 ? log_photo[i] : 1) + 0.01f);
    const double middle = nearest((size_t)given * values, log_photo, rendered->t.data, 0, MOST_STOPS + TOLERATED_STOPS,
                                  COARSE_STOPS, grid.threads);
    const double found = nearest((size_t)given * values, log_photo, rendered->t.data, middle, COARSE_STOPS, STEP_STOPS,
                                 grid.threads);
    const double beyond = fmin(fmax(fabs(found) - TOLERATED_STOPS, 0), MOST_STOPS);
    *factor = exp2(found < 0 ? -beyond : beyond);
    return TS_OK;
}

ts_code lgd_fit_power(ag_tape *tape, const nn_model *model, const float *const *image, const rd_view *views, int given,
                      int side, int orientations, float *r0, double *factor, ts_status *st)
{
    const ts_mark mark = ag_scope_begin(tape);
    const ts_code code = fit(tape, model, image, views, given, side, orientations, r0, factor, st);
    ag_scope_end(tape, mark, NULL, 0);
    return code;
}
