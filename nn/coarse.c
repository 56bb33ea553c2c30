/* The coarse steps (docs/math.md, S13). */
#include "nn/lgd_internal.h"
#include "ops.h"
#include <string.h>

enum { BAND = 1 << 17 }; /* pixels of the photograph that are read at a time, about */

/* Maps of material n in rows y0 .. y0 + rows - 1 of its photographs. */
static void upsampled(const ag_tape *tape, const nn_coarse *c, int n, int y0, int rows, float *to)
{
    const ts_shape s = c->maps->t.shape;
    const ts_taps own = ts_taps_part(&c->up, y0, rows);
    ts_resample(1, s.c, &own, &c->up, c->maps->t.data + (int64_t)n * s.h * s.w * s.c, to, false,
                ag_compute(tape)->threads);
}

/* RMSE(R_0) at the photographs' size, in bands. */
static bool measure(ag_tape *tape, const nn_model *model, nn_coarse *c)
{
    const int side = c->in.grid.side, count = nn_given(&c->in), most = BAND / side > 0 ? BAND / side : 1,
              channels = c->maps->t.shape.c;
    c->state.rmse0 = ts_arena_zalloc(ag_arena(tape), (size_t)c->in.image.shape.n, sizeof *c->state.rmse0);
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    float *maps = ts_arena_alloc(ag_arena(tape),
                                 (size_t)(most < side ? most : side) * (size_t)side * (size_t)channels * sizeof *maps);
    if (!c->state.rmse0 || !maps)
        return ag_fail(tape, TS_NOMEM, "no memory for the loss of %d x %d pixels", side, side), false;
    for (int i = 0; i < c->in.image.shape.n; i++) {
        double squares = 0;
        for (int y = 0; y < side; y += most) {
            const int rows = y + most < side ? most : side - y;
            const nn_input band = {
                .image = ts_view(c->in.image.data + ((int64_t)i * side + y) * side * 3, (ts_shape){1, rows, side, 3}),
                .grid = {.h = rows, .w = side, .y0 = y, .side = side, .threads = ag_compute(tape)->threads},
                .view = c->in.view,
                .views = c->in.views ? c->in.views + i : NULL};
            upsampled(tape, c, i / count, y, rows, maps);
            nn_add_squares(model, &band, maps, channels, &squares);
        }
        c->state.rmse0[i] = nn_rmse_of(&squares, 1, (double)side * side);
    }
    ts_arena_release(ag_arena(tape), mark);
    return true;
}

/* Rows first .. last - 1 of the averaged gradient and Newton step (or NULL) of material n. */
static bool read_band(ag_tape *tape, const nn_model *model, const nn_coarse *c, int n, int first, int last,
                      float *gradient, float *newton)
{
    ts_arena *arena = ag_arena(tape);
    const int side = c->in.grid.side, count = nn_given(&c->in), channels = c->maps->t.shape.c,
              read = channels * model->arch.images, end = last - 1;
    const int y0 = c->down.first[first], rows = c->down.first[end] + c->down.offset[end + 1] - c->down.offset[end] - y0;
    const size_t pixels = (size_t)rows * (size_t)side;
    const ts_mark mark = ts_arena_mark(arena);
    float *const first_photo = c->in.image.data + ((int64_t)n * count * side + y0) * side * 3;
    ts_tensor maps = ts_new(arena, (ts_shape){1, rows, side, channels});
    ts_tensor photo = count > 1 ? ts_new(arena, (ts_shape){count, rows, side, 3})
                                : ts_view(first_photo, (ts_shape){1, rows, side, 3});
    float *g = ts_arena_alloc(arena, pixels * (size_t)read * sizeof *g),
          *d = newton ? ts_arena_alloc(arena, pixels * (size_t)channels * sizeof *d) : NULL;
    int *from = ts_arena_alloc(arena, (size_t)(last - first) * sizeof *from);
    bool fine = maps.data && photo.data && g && from && (d || !newton);
    if (!fine) ag_fail(tape, TS_NOMEM, "no memory for %d x %d pixels", side, rows);
    for (int k = 0; fine && count > 1 && k < count; k++)
        memcpy(photo.data + (size_t)k * pixels * 3, first_photo + (int64_t)k * side * side * 3,
               pixels * 3 * sizeof(float));
    if (fine) {
        const nn_input in = {.image = photo,
                             .grid = {.h = rows, .w = side, .y0 = y0, .side = side},
                             .view = c->in.view,
                             .views = c->in.views ? c->in.views + n * count : NULL,
                             .given = count};
        upsampled(tape, c, n, y0, rows, maps.data);
        fine = nn_read(tape, model, &in, &maps, c->state.rmse0 ? c->state.rmse0 + n * count : NULL, g, d);
    }
    if (fine) {
        ts_taps own = ts_taps_part(&c->down, first, last - first);
        for (int j = first; j < last; j++) from[j - first] = c->down.first[j] - y0;
        own.in = rows;
        own.first = from;
        const int64_t row = (int64_t)c->down.out;
        ts_resample(1, read, &own, &c->down, g, gradient + first * row * read, false, ag_compute(tape)->threads);
        if (newton)
            ts_resample(1, channels, &own, &c->down, d, newton + first * row * channels, false,
                        ag_compute(tape)->threads);
    }
    ts_arena_release(arena, mark);
    return fine;
}

/* R_{t+1} and its states from the averages. */
static bool step(ag_tape *tape, const nn_model *model, nn_coarse *c)
{
    const nn_refiner *h = &((const nn_layers *)model->layers)->coarse;
    const ts_shape s = c->maps->t.shape;
    const int side = c->in.grid.side;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *gradient = ag_empty(tape, (ts_shape){s.n, s.h, s.w, s.c * model->arch.images});
    ag_value *newton = nn_descends(model, NN_DESCENT_NEWTON) ? ag_empty(tape, s) : NULL;
    if (ag_status(tape)->code) return false;
    const int64_t pixels = (int64_t)s.h * s.w, rows = (int64_t)s.h * BAND / ((int64_t)side * side),
                  most = rows < 1 ? 1
        : rows > s.h              ? s.h
                                  : rows;
    for (int n = 0; n < s.n; n++)
        for (int y = 0; y < s.h; y += (int)most)
            if (!read_band(tape, model, c, n, y, y + (int)most < s.h ? y + (int)most : s.h,
                           gradient->t.data + n * pixels * gradient->t.shape.c,
                           newton ? newton->t.data + n * pixels * s.c : NULL))
                return false;
    ag_value *keep[3] = {nn_apply(tape, model, h, c->maps, gradient, newton, &c->state), c->state.gru[0],
                         c->state.gru[1]};
    if (!keep[0]) return false;
    ag_scope_end(tape, mark, keep, 3);
    c->maps = keep[0];
    c->state.gru[0] = keep[1];
    c->state.gru[1] = keep[2];
    return true;
}

typedef struct step_of {
    const nn_model *model;
    nn_coarse c;
} step_of;

/* in and out: R and the states, as nn/lgd.c has them. */
static void step_again(ag_tape *tape, ag_value *const *in, ag_value **out, const void *user)
{
    const step_of *s = user;
    nn_coarse c = s->c;
    c.maps = in[0];
    for (int i = 0; i < 2; i++) c.state.gru[i] = in[i + 1];
    if (!step(tape, s->model, &c)) return;
    out[0] = c.maps;
    for (int i = 0; i < 2 && s->model->arch.recurrent; i++) out[i + 1] = c.state.gru[i];
}

static bool step_and_forget(ag_tape *tape, const nn_model *model, nn_coarse *c)
{
    const step_of of = {model, *c};
    ag_value *const from[3] = {c->maps, c->state.gru[0], c->state.gru[1]};
    ag_value *to[3] = {0};
    if (!ag_checkpoint(tape, step_again, &of, sizeof of, 3, from, c->buffer[c->state.step % 2],
                       model->arch.recurrent ? 3 : 1, to))
        return false;
    c->maps = to[0];
    for (int i = 0; i < 2; i++) c->state.gru[i] = to[i + 1];
    c->state.step++;
    return true;
}

/* The photographs that the steps read, resampled when they are large. */
static bool limit_size(ag_tape *tape, const nn_model *model, nn_coarse *c)
{
    const int64_t most = (int64_t)model->arch.coarse_size * NN_COARSE_READS;
    if (c->side <= most) return true;
    const ts_tensor whole = c->in.image;
    c->in.grid = rd_grid_full((int)most);
    return nn_resized(tape, &whole, (int)most, &c->in.image);
}

bool nn_coarse_step(ag_tape *tape, const nn_model *model, nn_coarse *c)
{
    const int size = c->side < model->arch.coarse_size ? c->side : model->arch.coarse_size;
    if (c->maps->t.shape.h != size) c->maps = ag_resize_smooth(tape, c->maps, size, size); /* it came from g */
    if (!c->maps) return false;
    const ts_shape s = c->maps->t.shape;
    if (!c->up.weight) {
        if (!limit_size(tape, model, c)) return false;
        const int side = c->in.grid.side;
        c->up = ts_taps_smooth(ag_arena(tape), s.h, side);
        c->down = ts_taps_triangle(ag_arena(tape), side, s.h);
        if (!c->up.weight || !c->down.weight) return ag_fail(tape, TS_NOMEM, "no memory for the filter"), false;
    }
    if (model->arch.gradient && !c->state.rmse0 && !measure(tape, model, c)) return false;
    if (!c->in.recompute || !ag_gradients(tape)) return step(tape, model, c);
    return (c->buffer[0][0] || nn_gradient_buffers(tape, c->maps, model->arch.coarse_gru, c->buffer)) &&
        step_and_forget(tape, model, c);
}

ts_code nn_coarse_steps(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, ag_value **maps,
                        bool (*after)(int t, void *user), void *user)
{
    nn_coarse c;
    bool on = nn_coarse_begin(tape, model, in, &c);
    for (int t = 0; on; t++) {
        maps[t] = c.maps;
        on = (!after || after(t, user)) && t < steps && nn_coarse_step(tape, model, &c);
    }
    return ag_status(tape)->code;
}
