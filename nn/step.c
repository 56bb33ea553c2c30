/* A refinement step: the gradient and the Newton step of R_t, and R_{t+1} from them (docs/math.md, S4 to S11). */
#include "nn/burnt.h"
#include "nn/facing.h"
#include "nn/lgd_internal.h"
#include "ops.h"
#include "render/posterior.h"
#include "render/published.h"
#include "render/render.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <string.h>

enum { STEP = 1 << 12 }; /* values at a time, at least */

bool nn_gradient_buffers(ag_tape *tape, const ag_value *maps, int gru, float *buffer[2][3])
{
    const size_t pixels = (size_t)ts_pixels(maps->t.shape);
    for (int i = 0; i < 6; i++) {
        const int channels = i % 3 ? gru : maps->t.shape.c;
        float **b = &buffer[i / 3][i % 3];
        *b = channels ? ts_arena_alloc(ag_arena(tape), pixels * (size_t)channels * sizeof(float)) : NULL;
        if (channels && !*b) return ag_fail(tape, TS_NOMEM, "no memory for a step's gradients"), false;
    }
    return true;
}

bool nn_measure_start(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, nn_state *state)
{
    if (!maps || !model->arch.gradient) return maps != NULL;
    nn_input all = *in;
    all.grid = rd_grid_on(in->grid, ag_compute(tape)->threads);
    if (in->whole.data) {
        all.image = in->whole;
        all.grid = rd_grid_on(rd_grid_full(in->grid.side), all.grid.threads);
    }
    const int photographs = all.image.shape.n;
    state->rmse0 = ts_arena_zalloc(ag_arena(tape), (size_t)photographs, sizeof *state->rmse0);
    if (!state->rmse0) return ag_fail(tape, TS_NOMEM, "no memory for the loss of %d images", photographs), false;
    nn_add_squares(model, &all, maps->t.data, maps->t.shape.c, state->rmse0);
    for (int i = 0; i < photographs; i++)
        state->rmse0[i] = nn_rmse_of(&state->rmse0[i], 1, (double)all.grid.h * all.grid.w);
    return true;
}

typedef struct place_job {
    int channels, images, k;
    const float *from;
    float *to;
} place_job;

static void place_pixels(const void *job, int64_t begin, int64_t end)
{
    const place_job *j = job;
    for (int64_t i = begin; i < end; i++)
        memcpy(j->to + (i * j->images + j->k) * j->channels, j->from + i * j->channels,
               (size_t)j->channels * sizeof *j->to);
}

/* to [pixels, images channels] = from [pixels, channels] at photograph k's place. */
static void place(int64_t pixels, int channels, int images, int k, const float *from, float *to, int threads)
{
    ts_for(threads, pixels, STEP, place_pixels, &(place_job){channels, images, k, from, to});
}

typedef struct values_job {
    float *to, scale;
    int64_t row;
} values_job;

static void scale_values(const void *job, int64_t begin, int64_t end)
{
    const values_job *j = job;
    for (int64_t i = begin; i < end; i++) j->to[i] *= j->scale;
}

static void asinh_rows(const void *job, int64_t begin, int64_t end)
{
    const values_job *j = job;
    for (int64_t y = begin; y < end; y++)
        ts_elementwise_k()->asinh(j->row, NN_GRADIENT_SCALE, j->to + y * j->row, j->to + y * j->row);
}

/* dL/dR_t of every photograph, not encoded: to is [N, H, W, images channels]. */
static bool gradients(ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *maps,
                      const double *rmse0, float *to)
{
    const ts_shape s = maps->shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    const int count = nn_given(in), images = model->arch.images;
    const rd_grid grid = rd_grid_on(in->grid, ag_compute(tape)->threads);
    const bool batch = model->arch.rmse == NN_RMSE_BATCH;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    float *apart = images > 1 ? ts_arena_alloc(ag_arena(tape), (size_t)(pixels * s.c) * sizeof *apart) : NULL;
    if (images > 1 && !apart)
        return ag_fail(tape, TS_NOMEM, "no memory for the gradient of %d x %d pixels", s.w, s.h), false;
    if (count < images) memset(to, 0, (size_t)(s.n * pixels * images * s.c) * sizeof *to);
    double *squares = batch ? ts_arena_zalloc(ag_arena(tape), (size_t)(s.n * count), sizeof *squares) : NULL;
    if (batch && !squares) return ag_fail(tape, TS_NOMEM, "no memory for the loss of %d images", s.n * count), false;
    nn_input all = *in;
    all.grid = grid;
    if (batch) nn_add_squares(model, &all, maps->data, s.c, squares);
    const double common = batch ? nn_rmse_of(squares, s.n * count, (double)pixels) : 0;
    for (int i = 0; i < s.n * count; i++) {
        const int n = i / count, k = i % count;
        const double rmse = batch ? common : rmse0[i];
        const rd_view view = nn_view_of(model, in, i);
        float *own = to + n * pixels * images * s.c;
        rd_flash_gradient(grid, maps->data + n * pixels * s.c, s.c, &view, in->image.data + i * pixels * 3, rmse,
                          apart ? apart : own, NULL);
        if (apart) place(pixels, s.c, images, k, apart, own, grid.threads);
    }
    ts_arena_release(ag_arena(tape), mark);
    if (batch) { /* d RMSE of the whole batch has 1 / (3 N H W) where rd_flash_gradient has 1 / (3 256^2) */
        const float scale = (float)(256.0 * 256.0 / ((double)s.n * s.h * s.w));
        ts_for(ag_compute(tape)->threads, s.n * pixels * images * s.c, STEP, scale_values,
               &(values_job){.to = to, .scale = scale});
    }
    return true;
}

/* The Newton step: to is [N, H, W, channels]. */
static void newton_step(const ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *maps,
                        float *to)
{
    float damping[MAP_CHANNELS];
    for (int i = 0; i < MAP_CHANNELS; i++)
        damping[i] = i >= MAP_SPECULAR ? NN_NEWTON_DAMPING_SPECULAR : NN_NEWTON_DAMPING;
    const ts_shape s = maps->shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    const int count = nn_given(in);
    for (int n = 0; n < s.n; n++) {
        rd_view view[NN_MAX_IMAGES];
        const float *image[NN_MAX_IMAGES];
        for (int k = 0; k < count; k++) {
            view[k] = nn_view_of(model, in, n * count + k);
            image[k] = in->image.data + (n * count + k) * pixels * 3;
        }
        rd_newton_step(rd_grid_on(in->grid, ag_compute(tape)->threads), maps->data + n * pixels * s.c, s.c, view, image,
                       count, damping, to + n * pixels * s.c);
    }
}

/* The noise is the Newton step's. What is more: a photograph whose light's power is known was taken with care, and
 * renderer and lens leave out little; what they do, one photograph cannot tell from its maps, and several can. Of
 * another neither tone curve nor vignetting nor other light is known, and what they change goes with the value. One
 * photograph, whose light may be another's, is not to make a dark colour black. */
ts_prior nn_step_prior(int known, int photographs)
{
    const bool careful = known & NN_KNOWN_POWER;
    return (ts_prior){.hue = {0.1f, 0.1f},
                      .model = !careful     ? 0.1f
                          : photographs > 1 ? 0.01f
                                            : 0.02f,
                      .noise = 0.002f,
                      .gain = careful ? 0 : 0.5f,
                      .share = photographs > 1 ? 0 : 0.5f};
}

/* A photograph whose light's power is known was taken with care: there a pixel may say more than its neighbours. */
bool nn_settles_burnt(const nn_model *model, const nn_input *in)
{
    return nn_descends(model, NN_DESCENT_POSTERIOR) && nn_given(in) == 1 && in->known &&
        !(in->known[0] & NN_KNOWN_POWER);
}

int nn_steps_reach(const nn_model *model, const nn_input *in, int first, int end)
{
    if (!nn_settles_burnt(model, in)) return nn_refiner_reach(model) * (end - first);
    const int settling = model->arch.iterations < end ? model->arch.iterations : end;
    return first < settling ? nn_burnt_reach(in->grid.side) * (settling - first) : 0;
}

/* Steps beyond those that the model is made for would need ever more of what is around a tile: there the maps rest. */
static bool settle(ag_tape *tape, const nn_model *model, rd_grid grid, const ts_tensor *maps, const nn_state *state,
                   float *step)
{
    const int channels = maps->shape.c;
    if (state->step >= model->arch.iterations) nn_burnt_hold(grid, state->burnt, channels, step);
    else if (!nn_burnt_settle(grid, state->burnt, state->mean, maps->data, channels, ag_arena(tape), step))
        return ag_fail(tape, TS_NOMEM, "no memory for a step of %d x %d pixels", grid.w, grid.h), false;
    return true;
}

/* The step to the most probable maps, given all photographs of one material: to is [1, H, W, channels]. */
static bool posterior_step(ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *maps,
                           const nn_state *state, float *to)
{
    const ts_shape s = maps->shape;
    const int count = nn_given(in);
    if (!state->mean || !state->deviation || (count > 1 && !(state->best && state->misfit)) || s.n != 1)
        return ag_fail(tape, TS_INVALID, "the step to the most probable maps needs the prior of one material"), false;
    const int64_t values = (int64_t)s.h * s.w * 3;
    rd_view view[NN_MAX_IMAGES];
    const float *image[NN_MAX_IMAGES];
    for (int k = 0; k < count; k++) {
        view[k] = nn_view_of(model, in, k);
        image[k] = in->image.data + k * values;
    }
    const rd_prior prior = {state->mean, state->deviation,
                            nn_step_prior(in->known ? in->known[0] : NN_KNOWN_ALL, count)};
    const rd_search search = {state->best, state->misfit, state->step > 0};
    rd_posterior_step(rd_grid_on(in->grid, ag_compute(tape)->threads), maps->data, s.c, view, image, count, &prior,
                      rd_step_length(count, state->step), count > 1 ? &search : NULL, to, NULL);
    return !state->burnt || settle(tape, model, rd_grid_on(in->grid, ag_compute(tape)->threads), maps, state, to);
}

bool nn_read(ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *maps, const double *rmse0,
             float *gradient, float *newton)
{
    const ts_shape s = maps->shape;
    const int64_t rows = (int64_t)s.n * s.h, row = (int64_t)s.w * s.c * model->arch.images;
    if (newton) newton_step(tape, model, in, maps, newton);
    if (!gradient) return true;
    if (!model->arch.gradient) {
        memset(gradient, 0, (size_t)(rows * row) * sizeof *gradient);
        return true;
    }
    if (!gradients(tape, model, in, maps, rmse0, gradient)) return false;
    if (model->arch.encoding != NN_GRADIENT_ASINH) return true;
    ts_for(ag_compute(tape)->threads, rows, 1, asinh_rows, &(values_job){.to = gradient, .row = row});
    return true;
}

/* S7: h is not trained to come to rest, and beyond T what is left of its steps adds up to a drift. Step t > T has the
 * length (T / t)^2; all of them together are less than T whole steps. The published loop keeps 1. */
static float length(const nn_arch *a, int t)
{
    if (t <= a->iterations || a->compat == NN_COMPAT_PUBLISHED) return 1;
    const float left = (float)(a->iterations > 0 ? a->iterations : 1) / (float)t;
    return left * left;
}

bool nn_descends(const nn_model *model, nn_descent how) { return model->arch.gradient && model->arch.descent == how; }

ag_value *nn_apply(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *gradient,
                   ag_value *newton, nn_state *state)
{
    ag_value *descent = nn_descends(model, NN_DESCENT_GRADIENT) ? gradient : newton;
    state->step++;
    return nn_step(tape, model, h, maps, descent, gradient, state->gru, state->to, length(&model->arch, state->step),
                   state->into);
}

ag_value *nn_refine(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps, nn_state *state)
{
    if (!nn_input_check(tape, model, in) || !maps) return NULL;
    const nn_refiner *h = &((const nn_layers *)model->layers)->h;
    ts_shape s = maps->t.shape;
    if (!nn_arch_refines_full(&model->arch))
        return ag_fail(tape, TS_INVALID, "the model has no refiner: 0 iterations are all that it can do");
    if (!ts_same(s, (ts_shape){nn_materials(in), in->grid.h, in->grid.w, model->arch.channels}))
        return ag_fail(tape, TS_INVALID,
                       "the maps are %d x %d x %d x %d, not the photograph's size and the model's %d channels", s.n,
                       s.h, s.w, s.c, model->arch.channels);
    if (nn_arch_reads(&model->arch) && model->arch.rmse == NN_RMSE_START && !state->rmse0 &&
        !nn_measure_start(tape, model, in, maps, state))
        return NULL;
    ag_value *gradient = NULL, *newton = NULL;
    if (h->width > 0 || nn_descends(model, NN_DESCENT_GRADIENT))
        gradient = ag_empty(tape, (ts_shape){s.n, s.h, s.w, s.c * model->arch.images});
    if (nn_descends(model, NN_DESCENT_POSTERIOR)) {
        ag_value *step = ag_empty(tape, s);
        if (!step || !posterior_step(tape, model, in, &maps->t, state, step->t.data)) return NULL;
        state->step++;
        ag_into(tape, state->into);
        ag_value *next = ag_add(tape, maps, step);
        if (next && nn_given(in) == 1)
            nn_face_camera(rd_grid_on(in->grid, ag_compute(tape)->threads), nn_view_of(model, in, 0).camera, s.c,
                           next->t.data);
        return next;
    }
    if (nn_descends(model, NN_DESCENT_NEWTON)) newton = ag_empty(tape, s);
    if (ag_status(tape)->code) return NULL;
    if (!nn_read(tape, model, in, &maps->t, state->rmse0, gradient ? gradient->t.data : NULL,
                 newton ? newton->t.data : NULL))
        return NULL;
    return nn_apply(tape, model, h, maps, gradient, newton, state);
}
