/* The unrolled loop (docs/math.md, M8): R_0 = g(image), then the coarse steps (nn/coarse.c), then the steps at the
 * photograph's size (nn/step.c). Luo, Scandolo, Bousseau, Eisemann, "Single-Image SVBRDF Estimation with Learned
 * Gradient Descent", CGF 43(2), 2024. */
#include "nn/lgd_internal.h"
#include "ops.h"
#include <string.h>

/* The part of maps of the whole that in->image shows. */
static ag_value *window(ag_tape *tape, const nn_input *in, ag_value *maps)
{
    const rd_grid g = in->grid;
    return in->whole.data ? ag_crop(tape, maps, g.y0, g.x0, g.h, g.w) : maps;
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

bool nn_gradient_rooms(ag_tape *tape, const ag_value *maps, int gru, float *room[2][3])
{
    const size_t pixels = (size_t)ts_pixels(maps->t.shape);
    for (int i = 0; i < 6; i++) {
        const int channels = i % 3 ? gru : maps->t.shape.c;
        room[i / 3][i % 3] = channels ? ts_arena_alloc(ag_arena(tape), pixels * (size_t)channels * sizeof(float))
                                      : NULL;
        if (channels && !room[i / 3][i % 3]) return ag_fail(tape, TS_NOMEM, "no memory for a step's gradients"), false;
    }
    return true;
}

static ag_value *step_and_forget(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps,
                                 nn_state *state, float *const room[3])
{
    const step_of of = {model, *in, state->rmse0, state->step};
    ag_value *const from[3] = {maps, state->gru[0], state->gru[1]};
    ag_value *to[3] = {0};
    if (!ag_checkpoint(tape, step_again, &of, sizeof of, 3, from, room, nn_arch_carries(&model->arch) ? 3 : 1, to))
        return NULL;
    state->gru[0] = to[1];
    state->gru[1] = to[2];
    state->step++;
    return to[0];
}

/* On a tape without gradients a step gives back its memory: R_t and the states are in buffers made before. */
static ag_value *step_and_release(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps,
                                  nn_state *state, ag_value *to)
{
    ts_mark mark = ag_scope_begin(tape);
    state->into = to;
    if (!nn_refine(tape, model, in, maps, state)) return NULL;
    ag_scope_end(tape, mark, NULL, 0);
    for (int i = 0; i < 2; i++) state->gru[i] = state->to[i];
    return to;
}

/* Maps at the size of the whole photograph. */
static ag_value *resampled(ag_tape *tape, int side, ag_value *maps)
{
    return maps->t.shape.h == side ? maps : ag_resize_smooth(tape, maps, side, side);
}

static bool looks(const nn_watch *watch, int t, int steps)
{
    return watch && (!watch->ends_alone || t == 0 || t == steps);
}

static bool goes_on(const nn_watch *watch, int t, int steps, const ag_value *maps)
{
    return !watch || watch->after(t, looks(watch, t, steps) ? maps : NULL, watch->user);
}

/* R_t of the coarse steps for the caller: the window's, and in *whole that of the whole photographs. */
static ag_value *show(ag_tape *tape, const nn_input *in, const nn_coarse *c, ag_value **whole)
{
    *whole = resampled(tape, c->side, c->maps);
    return *whole ? window(tape, in, *whole) : NULL;
}

/* R_0 and the maps of the coarse steps, into maps as in nn_lgd. Returns the last, of the whole photographs, and
 * in *t its step; *on: to go on. */
static ag_value *first_steps(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, bool keep_all,
                             ag_value **maps, const nn_watch *watch, int *t, bool *on)
{
    const int most = steps < model->arch.coarse_steps ? steps : model->arch.coarse_steps;
    nn_coarse c;
    ag_value *whole = NULL;
    *on = nn_coarse_begin(tape, model, in, &c);
    for (*t = 0; *on; ++*t) {
        const ts_mark mark = ag_scope_begin(tape);
        ag_value *seen = NULL;
        const bool wanted = *t == most || keep_all || looks(watch, *t, steps);
        if (wanted && !(seen = show(tape, in, &c, &whole))) return NULL;
        *on = goes_on(watch, *t, steps, seen);
        if (!*on && !seen && !(seen = show(tape, in, &c, &whole))) return NULL;
        if (seen) maps[keep_all ? *t : 0] = seen;
        if (*t == most || !*on) break;
        if (!keep_all) ag_scope_end(tape, mark, NULL, 0); /* not read again */
        *on = nn_coarse_step(tape, model, &c);
    }
    return whole;
}

ts_code nn_lgd(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, bool keep_all, ag_value **maps,
               const nn_watch *watch)
{
    const bool release = !ag_gradients(tape);
    int t;
    bool on;
    if (steps > 0 && !ag_status(tape)->code && !nn_arch_refines(&model->arch))
        ag_fail(tape, TS_INVALID, "the model has no refiner: 0 iterations are all that it can do");
    ag_value *whole = first_steps(tape, model, in, steps, keep_all, maps, watch, &t, &on),
             *buffer = NULL; /* buffer: of R_t */
    ag_value *now = whole ? maps[keep_all ? t : 0] : NULL;
    nn_state state = {.step = t};
    const bool full = now && on && t < steps && nn_arch_refines_full(&model->arch);
    if (full && nn_arch_reads(&model->arch) && model->arch.rmse != NN_RMSE_BATCH &&
        !nn_measure_start(tape, model, in, whole, &state))
        return ag_status(tape)->code;
    if (full && release) {
        ts_shape s = now->t.shape;
        buffer = now;
        for (int i = 0; i < 2 && nn_arch_carries(&model->arch); i++)
            state.to[i] = ag_empty(tape, (ts_shape){s.n, s.h, s.w, model->arch.h_gru});
    }
    float *room[2][3] = {{0}};
    if (full && !release && in->recompute &&
        !nn_gradient_rooms(tape, now, model->arch.h_width ? model->arch.h_gru : 0, room))
        return ag_status(tape)->code;
    while (now && on && t < steps) {
        if (!full) { /* nothing is left to do */
        } else if (release) {
            if (keep_all) buffer = ag_empty(tape, now->t.shape);
            if (!buffer) break;
            now = step_and_release(tape, model, in, now, &state, buffer);
        } else
            now = in->recompute ? step_and_forget(tape, model, in, now, &state, room[t % 2])
                                : nn_refine(tape, model, in, now, &state);
        if (!now) break;
        t++;
        maps[keep_all ? t : 0] = now;
        on = goes_on(watch, t, steps, now);
    }
    if (keep_all)
        for (int i = t + 1; i <= steps; i++) maps[i] = now;
    return ag_status(tape)->code;
}
