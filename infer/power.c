#include "infer/power.h"
#include "render/render.h"
#include "tensor/resize.h"
#include <math.h>
#include <string.h>

/* Stops by which R_0's brightness errs where nothing is amiss: the estimate is that much nearer to 1, so that usual photographs keep the usual light. */
#define USUAL_STOPS 0.2
#define CLIPPED 0.98f /* sensor values at and above say only that there is more light */

static void add_products(size_t values, const float *photo, const float *rendered, double *photo_rendered, double *rendered_rendered)
{
    for (size_t i = 0; i < values; i++) {
        if (photo[i] >= CLIPPED) continue;
        *photo_rendered += (double)photo[i] * (double)rendered[i];
        *rendered_rendered += (double)rendered[i] * (double)rendered[i];
    }
}

ts_code lgd_fit_power(ag_tape *tape, const nn_model *model, const float *const *image, const rd_view *views, int given, int side, double *factor, ts_status *st)
{
    const int size = model->arch.g_size;
    const rd_grid grid = rd_grid_full(size);
    const size_t values = (size_t)size * (size_t)size * 3, whole = (size_t)side * (size_t)side * 3;
    *factor = 1;
    ag_reset(tape);
    ag_value *small = ag_empty(tape, (ts_shape){given, size, size, 3}), *rendered = ag_empty(tape, (ts_shape){1, size, size, 3});
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *full = ag_empty(tape, (ts_shape){given, side, side, 3});
    if (!small || !rendered || !full) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", side, side);
    for (int k = 0; k < given; k++)
        for (size_t i = 0; i < whole; i++) full->t.data[(size_t)k * whole + i] = isfinite(image[k][i]) ? fminf(fmaxf(image[k][i], 0), 1) : 0;
    if (side == size) memcpy(small->t.data, full->t.data, (size_t)given * values * sizeof(float));
    else if (ts_resize(&small->t, &full->t, ag_arena(tape), st)) return st->code;
    ag_scope_end(tape, mark, NULL, 0);
    const nn_input in = {.image = small->t, .grid = grid, .views = views, .given = given};
    const ag_value *maps = nn_predict(tape, model, &in);
    if (!maps) {
        *st = *ag_status(tape);
        return st->code;
    }
    double products = 0, squares = 0;
    for (int k = 0; k < given; k++) {
        rd_render(grid, maps->t.data, maps->t.shape.c, &views[k], false, rendered->t.data);
        add_products(values, small->t.data + (size_t)k * values, rendered->t.data, &products, &squares);
    }
    if (products > 0 && squares > 0) {
        const double stops = log2(products / squares), beyond = fmin(fmax(fabs(stops) - USUAL_STOPS, 0), 3);
        *factor = exp2(stops < 0 ? -beyond : beyond);
    }
    return TS_OK;
}
