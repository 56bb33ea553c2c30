/* The unrolled loop (docs/math.md, M8): R_0 = g(image), then the coarse steps (nn/coarse.c), then the steps at the
 * photograph's size (nn/step.c). Luo, Scandolo, Bousseau, Eisemann, "Single-Image SVBRDF Estimation with Learned
 * Gradient Descent", CGF 43(2), 2024. */
#include "nn/lgd_internal.h"
#include "nn/window.h"
#include "ops.h"
#include <math.h>
#include <string.h>

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

static ag_value *step_and_forget(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps,
                                 nn_state *state, float *const buffer[3])
{
    const step_of of = {model, *in, state->rmse0, state->step};
    ag_value *const from[3] = {maps, state->gru[0], state->gru[1]};
    ag_value *to[3] = {0};
    if (!ag_checkpoint(tape, step_again, &of, sizeof of, 3, from, buffer, nn_arch_carries(&model->arch) ? 3 : 1, to))
        return NULL;
    state->gru[0] = to[1];
    state->gru[1] = to[2];
    state->step++;
    return to[0];
}

static double change(const float *a, const float *b, size_t values)
{
    double sum = 0;
    for (size_t i = 0; i < values; i++) sum += (double)(a[i] - b[i]) * (double)(a[i] - b[i]);
    return sqrt(sum / (double)values);
}

/* v = the part of from that the window shows. */
static void crop(rd_grid whole, rd_grid part, const float *from, ag_value *v)
{
    const ts_shape s = v->t.shape;
    nn_window_crop(whole, part, s.n, s.c, from, v->t.data);
    v->t = ts_view(v->t.data, (ts_shape){s.n, part.h, part.w, s.c});
}

/* On a tape without gradients a step gives back all that it took: R_t lives in to, which was made before, as the states
 * do. What is left of them is the window's part that the next steps need. */
static ag_value *step_and_release(ag_tape *tape, const nn_model *model, nn_loop *l, ag_value *maps, ag_value *to,
                                  bool *rests)
{
    const rd_grid now = l->in.grid;
    const int reach = nn_steps_reach(model, &l->in, l->state.step + 1, l->steps);
    const rd_grid next = nn_window_same(l->core, now) ? now : nn_window_grown(l->core, reach);
    const ts_mark mark = ag_scope_begin(tape);
    l->state.into = l->tolerance > 0 ? NULL : to;
    const ag_value *out = nn_refine(tape, model, &l->in, maps, &l->state);
    if (!out) return NULL;
    *rests = l->tolerance > 0 && change(maps->t.data, out->t.data, (size_t)ts_count(out->t.shape)) < l->tolerance;
    crop(now, next, out->t.data, to);
    for (int i = 0; i < 2 && l->state.to[i]; i++) crop(now, next, l->state.to[i]->t.data, l->state.to[i]);
    ag_scope_end(tape, mark, NULL, 0);
    for (int i = 0; i < 2; i++) l->state.gru[i] = l->state.to[i];
    if (!nn_window_same(now, next)) {
        ts_tensor *image = &l->in.image;
        nn_window_crop(now, next, image->shape.n, 3, image->data, image->data);
        *image = ts_view(image->data, (ts_shape){image->shape.n, next.h, next.w, 3});
        if (l->state.mean) nn_window_crop(now, next, 1, model->arch.channels, l->state.mean, l->state.mean);
        if (l->state.deviation) nn_window_crop(now, next, 1, NN_SPREADS, l->state.deviation, l->state.deviation);
        if (l->state.burnt) nn_window_crop(now, next, 1, 1, l->state.burnt, l->state.burnt);
        l->in.grid = next;
    }
    return to;
}

static bool looks(const nn_watch *watch, int t, int steps)
{
    return watch && (!watch->ends_alone || t == 0 || t == steps);
}

static bool goes_on(const nn_watch *watch, int t, int steps, const ag_value *maps)
{
    return !watch || watch->after(t, looks(watch, t, steps) ? maps : NULL, watch->user);
}

ts_code nn_steps(ag_tape *tape, const nn_model *model, nn_loop *l, ag_value **maps)
{
    const bool release = !ag_gradients(tape), again = !release && l->in.recompute,
               carries = nn_arch_carries(&model->arch);
    ag_value *now = maps[l->keep_all ? l->state.step : 0];
    const ts_shape s = now->t.shape;
    float *buffer[2][3] = {{0}};
    bool rests = !nn_arch_refines_full(&model->arch) || l->state.step == l->steps;
    l->made = 0;
    for (int i = 0; i < 2 && carries && release && !rests; i++)
        l->state.to[i] = ag_empty(tape, (ts_shape){s.n, s.h, s.w, model->arch.h_gru});
    if (again && !rests) nn_gradient_buffers(tape, now, model->arch.h_width ? model->arch.h_gru : 0, buffer);
    for (bool on = !ag_status(tape)->code; on && l->state.step < l->steps;) {
        const int t = l->state.step;
        l->made += !rests;
        ag_value *to = release && l->keep_all && !rests ? ag_empty(tape, now->t.shape) : now;
        if (rests) l->state.step++; /* nothing is left to do */
        else if (!to) break;
        else if (release) now = step_and_release(tape, model, l, now, to, &rests);
        else if (again) now = step_and_forget(tape, model, &l->in, now, &l->state, buffer[t % 2]);
        else now = nn_refine(tape, model, &l->in, now, &l->state);
        if (!now) break;
        maps[l->keep_all ? t + 1 : 0] = now;
        on = goes_on(l->watch, t + 1, l->steps, now);
    }
    if (release && now && !nn_window_same(l->in.grid, l->core)) crop(l->in.grid, l->core, now->t.data, now);
    return ag_status(tape)->code;
}

/* Of the whole, at its own size. */
static ag_value *resampled(ag_tape *tape, int side, ag_value *maps)
{
    return maps->t.shape.h == side ? maps : ag_resize_smooth(tape, maps, side, side);
}

/* The part of maps of the whole that in->image shows. */
static ag_value *window(ag_tape *tape, const nn_input *in, ag_value *maps)
{
    const rd_grid g = in->grid;
    return in->whole.data ? ag_crop(tape, maps, g.y0, g.x0, g.h, g.w) : maps;
}

/* R_0 and what the coarse steps leave, as others see it. */
typedef struct coarse_watch {
    ag_tape *tape;
    const nn_input *in;
    ag_value **coarse, **maps; /* at their own size; as nn_lgd has them */
    int last, steps;           /* last: of the coarse ones */
    bool keep_all, on;         /* on: nobody stopped */
    const nn_watch *watch;
    ag_value *whole; /* of the whole photographs, the last that was shown */
    int t;           /* its step */
} coarse_watch;

static ag_value *show(coarse_watch *w, int t)
{
    w->whole = resampled(w->tape, w->in->whole.data ? w->in->grid.side : w->in->image.shape.h, w->coarse[t]);
    return w->whole ? window(w->tape, w->in, w->whole) : NULL;
}

static bool after_coarse(int t, void *user)
{
    coarse_watch *w = user;
    const ts_mark mark = ag_scope_begin(w->tape);
    const bool wanted = t == w->last || w->keep_all || looks(w->watch, t, w->steps);
    ag_value *seen = wanted ? show(w, t) : NULL;
    if (wanted && !seen) return false;
    w->on = goes_on(w->watch, t, w->steps, seen);
    w->t = t;
    if (!w->on && !seen && !(seen = show(w, t))) return false;
    if (seen) w->maps[w->keep_all ? t : 0] = seen;
    if (w->on && t < w->last && !w->keep_all) ag_scope_end(w->tape, mark, NULL, 0); /* nobody looks at it again */
    return w->on;
}

ts_code nn_lgd(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, bool keep_all, ag_value **maps,
               const nn_watch *watch)
{
    const nn_arch *a = &model->arch;
    coarse_watch w = {.tape = tape,
                      .in = in,
                      .maps = maps,
                      .last = steps < a->coarse_steps ? steps : a->coarse_steps,
                      .steps = steps,
                      .keep_all = keep_all,
                      .watch = watch};
    if (steps > 0 && !ag_status(tape)->code && !nn_arch_refines(a))
        ag_fail(tape, TS_INVALID, "the model has no refiner: 0 iterations are all that it can do");
    w.coarse = ts_arena_zalloc(ag_arena(tape), (size_t)w.last + 1, sizeof *w.coarse);
    if (!w.coarse) ag_fail(tape, TS_NOMEM, "out of memory");
    if (ag_status(tape)->code || nn_coarse_steps(tape, model, in, w.last, w.coarse, after_coarse, &w))
        return ag_status(tape)->code;
    nn_loop loop = {.in = *in,
                    .core = rd_grid_on(in->grid, ag_compute(tape)->threads),
                    .steps = steps,
                    .state.step = w.t,
                    .keep_all = keep_all,
                    .watch = watch};
    if (w.on && w.t < steps && nn_arch_refines_full(a) && nn_arch_reads(a) && a->rmse != NN_RMSE_BATCH &&
        !nn_measure_start(tape, model, in, w.whole, &loop.state))
        return ag_status(tape)->code;
    if (w.on && nn_steps(tape, model, &loop, maps)) return ag_status(tape)->code;
    for (int i = loop.state.step + 1; i <= steps && keep_all; i++) maps[i] = maps[loop.state.step];
    return TS_OK;
}
