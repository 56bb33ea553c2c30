/* Learned gradient descent (Luo, Scandolo, Bousseau, Eisemann: "Single-Image SVBRDF Estimation with Learned Gradient Descent", CGF 43(2),
 * 2024): R_0 = g(image), R_{t+1} = R_t + h(R_t, dL/dR_t). */
#include "nn/layers.h"
#include "ops.h"
#include "render/published.h"
#include "render/render.h"
#include "render/tone.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/maps.h"
#include "tensor/resize.h"
#include "tensor/threads.h"
#include <math.h>
#include <string.h>

static int given(const nn_input *in) { return in->given > 0 ? in->given : 1; }
static int materials(const nn_input *in) { return in->image.shape.n / given(in); }

/* Under which a photograph was taken, as the model's renderer has it. */
static rd_view view_of(const nn_model *model, const nn_input *in, int photograph)
{
    rd_view view = in->views ? in->views[photograph] : in->view;
    if (model->arch.compat == NN_COMPAT_PUBLISHED && view.kind == RD_POINT) view.kind = RD_PUBLISHED;
    return view;
}

static bool check(ag_tape *tape, const nn_model *model, const nn_input *in)
{
    ts_shape s = in->image.shape;
    if (ag_status(tape)->code) return false;
    if (!model->value) ag_fail(tape, TS_INVALID, "the model has no parameters");
    else if (model->arch.latent > 0) ag_fail(tape, TS_INVALID, "the model is an auto-encoder of maps: it cannot read a photograph");
    else if (!in->image.data || s.c != 3) ag_fail(tape, TS_INVALID, "the photograph has %d channels: 3 are needed", s.c);
    else if (given(in) > model->arch.images)
        ag_fail(tape, TS_INVALID, "%d photographs are given: the model reads %d", given(in), model->arch.images);
    else if (s.n % given(in) != 0) ag_fail(tape, TS_INVALID, "%d photographs are not a multiple of %d", s.n, given(in));
    else if (!ts_contiguous(&in->image)) ag_fail(tape, TS_INVALID, "the photograph is not contiguous");
    else if (s.h != in->grid.h || s.w != in->grid.w)
        ag_fail(tape, TS_INVALID, "the photograph is %d x %d pixels, its grid %d x %d", s.w, s.h, in->grid.w, in->grid.h);
    else if (in->whole.data && !ts_same(in->whole.shape, (ts_shape){s.n, in->grid.side, in->grid.side, 3}))
        ag_fail(tape, TS_INVALID, "the whole photograph is %d x %d pixels, the window's grid says %d", in->whole.shape.w, in->whole.shape.h,
                in->grid.side);
    return !ag_status(tape)->code;
}

/* [N * given, S, S, 3] to [N, S, S, 3 images]. */
static void side_by_side(const ts_tensor *from, int count, int images, float *to)
{
    const int64_t pixels = (int64_t)from->shape.h * from->shape.w, rows = from->shape.n / count * pixels;
    for (int64_t i = 0; i < rows; i++) {
        const int64_t n = i / pixels, at = i % pixels;
        for (int k = 0; k < images; k++)
            for (int c = 0; c < 3; c++)
                to[(i * images + k) * 3 + c] = k < count ? from->data[((n * count + k) * pixels + at) * 3 + c] : -1.0f; /* -1: black, encoded */
    }
}

/* The photographs as g reads them: [N, g_size, g_size, 3 images], resampled while they are linear, then log-encoded. */
static ag_value *encoded(ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *image)
{
    const int size = model->arch.g_size, images = model->arch.images, count = given(in);
    ag_value *x = ag_empty(tape, (ts_shape){image->shape.n / count, size, size, 3 * images});
    if (!x) return NULL;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *each = images == 1 ? x : ag_empty(tape, (ts_shape){image->shape.n, size, size, 3});
    if (!each) return NULL;
    ts_status st = {0};
    const float *from = each->t.data;
    if (image->shape.h == size && image->shape.w == size) from = image->data;
    else if (ts_resize(&each->t, image, ag_arena(tape), &st)) return ag_fail(tape, st.code, "%s", st.message);
    rd_log_encode(ts_count(each->t.shape), from, each->t.data);
    if (images > 1) side_by_side(&each->t, count, images, x->t.data);
    ag_scope_end(tape, mark, NULL, 0);
    return x;
}

static bool central(const float p[3]) { return p[0] == 0 && p[1] == 0; }

bool nn_orients(const nn_model *model, const nn_input *in)
{
    const rd_view view = view_of(model, in, 0);
    return in->image.shape.n == 1 && model->arch.compat == NN_COMPAT_NONE && central(view.camera) && central(view.light);
}

ag_value *nn_predict(ag_tape *tape, const nn_model *model, const nn_input *in)
{
    if (!check(tape, model, in)) return NULL;
    const ts_tensor *photograph = in->whole.data ? &in->whole : &in->image;
    const int side = photograph->shape.h;
    if (side != photograph->shape.w)
        return ag_fail(tape, TS_INVALID, "the photograph is %d x %d pixels: g needs a square", photograph->shape.w, side);
    ts_mark mark = ag_scope_begin(tape);
    ag_value *x = encoded(tape, model, in, photograph);
    ag_value *maps = in->oriented && !ag_gradients(tape) && nn_orients(model, in) ? nn_unet_oriented(tape, model, x) : nn_unet(tape, model, x);
    if (side != model->arch.g_size) maps = ag_resize(tape, maps, side, side);
    ag_scope_end(tape, mark, &maps, 1);
    return maps;
}

/* The part of maps of the whole that in->image shows. */
static ag_value *window(ag_tape *tape, const nn_input *in, ag_value *maps)
{
    const rd_grid g = in->grid;
    return in->whole.data ? ag_crop(tape, maps, g.y0, g.x0, g.h, g.w) : maps;
}

/* The RMSE of R_0, which scales all later gradients: of the whole photographs where they are given, maps then being theirs. */
static bool measure_start(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, nn_state *state)
{
    if (!maps || !model->arch.gradient) return maps != NULL;
    const ts_tensor *image = in->whole.data ? &in->whole : &in->image;
    const rd_grid grid = in->whole.data ? rd_grid_full(in->grid.side) : in->grid;
    const ts_shape s = maps->t.shape;
    const int64_t one = (int64_t)s.h * s.w;
    const int photographs = image->shape.n;
    state->rmse0 = ts_arena_alloc(ag_arena(tape), (size_t)photographs * sizeof *state->rmse0);
    if (!state->rmse0) return ag_fail(tape, TS_NOMEM, "no memory for the loss of %d images", photographs), false;
    for (int i = 0; i < photographs; i++) {
        const rd_view view = view_of(model, in, i);
        rd_flash_rmse(grid, maps->t.data + i / given(in) * one * s.c, s.c, &view, image->data + i * one * 3, &state->rmse0[i]);
    }
    return true;
}

/* to [pixels, images channels] = from [pixels, channels] at photograph k's place. */
static void place(int64_t pixels, int channels, int images, int k, const float *from, float *to)
{
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
    for (int64_t i = 0; i < pixels; i++) memcpy(to + (i * images + k) * channels, from + i * channels, (size_t)channels * sizeof *to);
}

/* dL/dR_t of every photograph, as the renderer gives it: to is [N, H, W, images channels]. False without memory. */
static bool gradients(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, const nn_state *state, float *to)
{
    const ts_shape s = maps->t.shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    const int count = given(in), images = model->arch.images;
    const bool batch = model->arch.rmse == NN_RMSE_BATCH;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    float *apart = images > 1 ? ts_arena_alloc(ag_arena(tape), (size_t)(pixels * s.c) * sizeof *apart) : NULL;
    if (images > 1 && !apart) return ag_fail(tape, TS_NOMEM, "no memory for the gradient of %d x %d pixels", s.w, s.h), false;
    if (count < images) memset(to, 0, (size_t)(s.n * pixels * images * s.c) * sizeof *to);
    double common = 0;
    for (int i = 0; batch && i < s.n; i++) {
        double rmse;
        const rd_view view = view_of(model, in, i);
        rd_flash_rmse(in->grid, maps->t.data + i * pixels * s.c, s.c, &view, in->image.data + i * pixels * 3, &rmse);
        common += rmse * rmse / s.n;
    }
    for (int i = 0; i < s.n * count; i++) {
        const int n = i / count, k = i % count;
        const double rmse = batch ? sqrt(common) : state->rmse0[i];
        const rd_view view = view_of(model, in, i);
        float *own = to + n * pixels * images * s.c;
        rd_flash_gradient(in->grid, maps->t.data + n * pixels * s.c, s.c, &view, in->image.data + i * pixels * 3, rmse, apart ? apart : own,
                          NULL);
        if (apart) place(pixels, s.c, images, k, apart, own);
    }
    ts_arena_release(ag_arena(tape), mark);
    return true;
}

/* The gradients: a constant of the tape, [N, H, W, images channels]. */
static ag_value *loss_gradient(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, const nn_state *state)
{
    ts_shape s = maps->t.shape;
    ag_value *gradient = ag_empty(tape, (ts_shape){s.n, s.h, s.w, s.c * model->arch.images});
    if (!gradient) return NULL;
    float *g = gradient->t.data;
    const int64_t rows = (int64_t)s.n * s.h, row = (int64_t)s.w * gradient->t.shape.c;
    if (!model->arch.gradient) {
        memset(g, 0, (size_t)(rows * row) * sizeof *g);
        return gradient;
    }
    if (!gradients(tape, model, in, maps, state, g)) return NULL;
    if (model->arch.rmse == NN_RMSE_BATCH) { /* d RMSE of the whole batch has 1 / (3 N H W) where rd_flash_gradient has 1 / (3 256^2) */
        float scale = (float)(256.0 * 256.0 / ((double)s.n * s.h * s.w));
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
        for (int64_t i = 0; i < rows * row; i++) g[i] *= scale;
    }
    return gradient;
}

/* Encodes the gradients where they are. both (NULL: not asked for): [N, H, W, (1 + images) channels], the maps and the encoded gradients. */
static void encode(const nn_model *model, const ag_value *maps, ag_value *gradient, ag_value *both)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const ts_shape s = maps->t.shape;
    const int own = gradient->t.shape.c, all = s.c + own;
    const int64_t rows = (int64_t)s.n * s.h, w = s.w;
    const bool asinh_too = model->arch.encoding == NN_GRADIENT_ASINH && model->arch.gradient;
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
    for (int64_t y = 0; y < rows; y++) {
        float *g = gradient->t.data + y * w * own;
        if (asinh_too) k->asinh(w * own, NN_GRADIENT_SCALE, g, g);
        if (!both) continue;
        float *to = both->t.data + y * w * all;
        k->copy(w, s.c, maps->t.data + y * w * s.c, s.c, to, all, false);
        k->copy(w, own, g, own, to + s.c, all, false);
    }
}

/* Where Gauss and Newton's method would go: a constant of the tape, [N, H, W, channels]. */
static ag_value *newton_step(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps)
{
    float damping[MAP_CHANNELS];
    for (int i = 0; i < MAP_CHANNELS; i++) damping[i] = i >= MAP_SPECULAR ? NN_NEWTON_DAMPING_SPECULAR : NN_NEWTON_DAMPING;
    const ts_shape s = maps->t.shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    const int count = given(in);
    ag_value *to = ag_empty(tape, s);
    if (!to) return NULL;
    if (s.c > MAP_CHANNELS) memset(to->t.data, 0, (size_t)ts_count(s) * sizeof *to->t.data);
    for (int n = 0; n < s.n; n++) {
        rd_view view[NN_MAX_IMAGES];
        const float *image[NN_MAX_IMAGES];
        for (int k = 0; k < count; k++) {
            view[k] = view_of(model, in, n * count + k);
            image[k] = in->image.data + (n * count + k) * pixels * 3;
        }
        rd_newton_step(in->grid, maps->t.data + n * pixels * s.c, s.c, view, image, count, damping, to->t.data + n * pixels * s.c);
    }
    return to;
}

/* Nothing taught h that its steps must come to rest: beyond those it was trained for, what is left of them adds up to a drift. So step t > T goes
 * (T / t)^2 of its way, and all those together less than T whole steps. The published loop has no such rule. */
static ag_value *shortened(ag_tape *tape, const nn_arch *a, int t, ag_value *maps, ag_value *next)
{
    if (!next || t <= a->iterations || a->compat == NN_COMPAT_PUBLISHED) return next;
    const float left = (float)(a->iterations > 0 ? a->iterations : 1) / (float)t, weight = left * left, rest = 1 - weight;
    if (ag_gradients(tape)) return ag_add(tape, ag_scale(tape, maps, rest), ag_scale(tape, next, weight));
    const int64_t count = ts_count(next->t.shape); /* the same bytes, without memory of their own */
    const float *from = maps->t.data;
    float *to = next->t.data;
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
    for (int64_t i = 0; i < count; i++) to[i] = rest * from[i] + weight * to[i];
    return next;
}

ag_value *nn_refine(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps, nn_state *state)
{
    if (!check(tape, model, in) || !maps) return NULL;
    ts_shape s = maps->t.shape;
    if (!nn_arch_refines(&model->arch)) return ag_fail(tape, TS_INVALID, "the model has no refiner: 0 iterations are all that it can do");
    if (!ts_same(s, (ts_shape){materials(in), in->grid.h, in->grid.w, model->arch.channels}))
        return ag_fail(tape, TS_INVALID, "the maps are %d x %d x %d x %d, not the photograph's size and the model's %d channels", s.n, s.h, s.w, s.c,
                       model->arch.channels);
    if (model->arch.rmse == NN_RMSE_START && !state->rmse0 && !measure_start(tape, model, in, maps, state)) return NULL;
    const bool newton = model->arch.gradient && model->arch.descent == NN_DESCENT_NEWTON, read = model->arch.h_width > 0;
    ag_value *gradient = read || !newton ? loss_gradient(tape, model, in, maps, state) : NULL, *both = NULL, *path = NULL;
    if (model->arch.gradient && model->arch.descent == NN_DESCENT_GRADIENT) path = gradient;
    if (newton && !(path = newton_step(tape, model, in, maps))) return NULL;
    const bool joined = read && !ag_gradients(tape); /* else the gradient of R_t needs an operation that joins them */
    if (joined) both = ag_empty(tape, (ts_shape){s.n, s.h, s.w, (1 + model->arch.images) * s.c});
    if (ag_status(tape)->code) return NULL;
    if (gradient) encode(model, maps, gradient, both);
    if (read && !joined) both = ag_concat(tape, maps, gradient);
    ag_value *next = nn_step(tape, model, maps, path, both, state->gru, state->to);
    state->step++;
    return shortened(tape, &model->arch, state->step, maps, next);
}

typedef struct step_of {
    const nn_model *model;
    nn_input in;
    double *rmse0;
    int step;
} step_of;

/* in: R_t and the states; out: R_{t+1} and, where they are carried, the new states. */
static void step_again(ag_tape *tape, ag_value *const *in, ag_value **out, const void *user)
{
    const step_of *s = user;
    nn_state state = {.gru = {in[1], in[2]}, .rmse0 = s->rmse0, .step = s->step};
    out[0] = nn_refine(tape, s->model, &s->in, in[0], &state);
    for (int i = 0; i < 2 && nn_arch_carries(&s->model->arch); i++) out[i + 1] = state.gru[i];
}

/* Room for the gradients of R_t and the states: a step's and the next one's take turns. */
static float *gradient_room(ag_tape *tape, const ag_value *maps, int channels)
{
    float *room = ts_arena_alloc(ag_arena(tape), (size_t)ts_pixels(maps->t.shape) * (size_t)channels * sizeof *room);
    if (!room) ag_fail(tape, TS_NOMEM, "no memory for a step's gradients");
    return room;
}

static ag_value *step_and_forget(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps, nn_state *state, float *const room[3])
{
    const step_of of = {model, *in, state->rmse0, state->step};
    ag_value *const from[3] = {maps, state->gru[0], state->gru[1]};
    ag_value *to[3] = {0};
    if (!ag_checkpoint(tape, step_again, &of, sizeof of, 3, from, room, nn_arch_carries(&model->arch) ? 3 : 1, to)) return NULL;
    state->gru[0] = to[1];
    state->gru[1] = to[2];
    state->step++;
    return to[0];
}

/* On a tape without gradients a step gives back all that it took: R_t lives in a buffer that was made before, as the states do. */
static ag_value *step_and_release(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps, nn_state *state, ag_value *to)
{
    ts_mark mark = ag_scope_begin(tape);
    ag_value *next = nn_refine(tape, model, in, maps, state);
    if (!next) return NULL;
    memcpy(to->t.data, next->t.data, (size_t)ts_count(to->t.shape) * sizeof(float));
    ag_scope_end(tape, mark, NULL, 0);
    for (int i = 0; i < 2; i++) state->gru[i] = state->to[i];
    return to;
}

ts_code nn_lgd(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, bool keep_all, ag_value **maps, nn_after after, void *user)
{
    nn_state state = {0};
    ag_value *buffer = NULL; /* of R_t */
    bool release = !ag_gradients(tape);
    ag_value *predicted = nn_predict(tape, model, in), *now = NULL;
    if (predicted && (steps == 0 || model->arch.rmse == NN_RMSE_BATCH || measure_start(tape, model, in, predicted, &state)))
        now = window(tape, in, predicted);
    int t = 0;
    maps[0] = now;
    if (now && release && steps > 0) {
        ts_shape s = now->t.shape;
        buffer = now;
        for (int i = 0; i < 2 && nn_arch_carries(&model->arch); i++) state.to[i] = ag_empty(tape, (ts_shape){s.n, s.h, s.w, model->arch.h_gru});
    }
    float *room[2][3] = {{0}};
    for (int i = 0; now && !release && in->recompute && i < 6; i++) room[i / 3][i % 3] = gradient_room(tape, now, i % 3 ? model->arch.h_gru : now->t.shape.c);
    bool on = now && (!after || after(0, now, user));
    while (on && t < steps) {
        if (release && keep_all) buffer = ag_empty(tape, now->t.shape);
        if (release && !buffer) break;
        if (release) now = step_and_release(tape, model, in, now, &state, buffer);
        else now = in->recompute ? step_and_forget(tape, model, in, now, &state, room[t % 2]) : nn_refine(tape, model, in, now, &state);
        if (!now) break;
        t++;
        maps[keep_all ? t : 0] = now;
        on = !after || after(t, now, user);
    }
    if (keep_all)
        for (int i = t + 1; i <= steps; i++) maps[i] = now;
    return ag_status(tape)->code;
}
