#include "nn/revise.h"
#include "nn/deviation.h"
#include "nn/lgd_internal.h"
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "render/tone.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <string.h>

/* The channels that are read of a pixel, in this order. */
enum {
    PHOTO,
    BEFORE = PHOTO + 3, /* the photograph less the rendering of R */
    AFTER = BEFORE + 3, /* less that of R + d */
    STEP = AFTER + 3,   /* d */
    MAPS = STEP + MAP_CHANNELS,
    GRADIENT = MAPS + MAP_CHANNELS,
    SPREAD = GRADIENT + MAP_CHANNELS,
    READ = SPREAD + NN_SPREADS
};
_Static_assert((int)READ == NN_REVISION_READS && (int)MAPS == NN_REVISION_READS_AGAIN,
               "what layers read is what is written for them");

/* What is read, of n photographs: in squares of r x r pixels, a row of READ channels for each pixel and then those of
 * nn_conditions [N, g_size, g_size, (r r READ + NN_CONDITIONS)], and of single pixels what the last layers read again,
 * [N, side, side, AGAIN]. */
enum { AGAIN = MAPS + NN_COORDINATES };
typedef struct reading {
    ag_value *squares, *again;
} reading;

/* Of one photograph: pictures [side, side, 3], maps [side, side, MAP_CHANNELS]. */
typedef struct one {
    const float *photo, *before, *after; /* encoded */
    const float *maps, *step, *gradient, *spread, *conditions;
    float *squares, *again;
    int side, r;
} one;

static void put_pixel(const one *o, int64_t i, float *to)
{
    for (int c = 0; c < 3; c++) {
        const float photo = o->photo[3 * i + c];
        to[PHOTO + c] = photo;
        to[BEFORE + c] = photo - o->before[3 * i + c];
        to[AFTER + c] = photo - o->after[3 * i + c];
    }
    memcpy(to + STEP, o->step + i * MAP_CHANNELS, MAP_CHANNELS * sizeof *to);
    memcpy(to + MAPS, o->maps + i * MAP_CHANNELS, MAP_CHANNELS * sizeof *to);
    memcpy(to + GRADIENT, o->gradient + i * MAP_CHANNELS, MAP_CHANNELS * sizeof *to);
    memcpy(to + SPREAD, o->spread + i * NN_SPREADS, NN_SPREADS * sizeof *to);
}

/* Rows of squares. */
static void put_rows(const void *job, int64_t begin, int64_t end)
{
    const one *o = job;
    const int r = o->r, across = o->side / r;
    const size_t square = (size_t)(r * r * READ + NN_CONDITIONS);
    for (int64_t k = begin * across; k < end * across; k++) {
        float *to = o->squares + (size_t)k * square;
        const int y0 = (int)(k / across) * r, x0 = (int)(k % across) * r;
        for (int j = 0; j < r * r; j++, to += READ) {
            const int y = y0 + j / r, x = x0 + j % r;
            const int64_t i = (int64_t)y * o->side + x;
            float *again = o->again + i * AGAIN;
            put_pixel(o, i, to);
            memcpy(again, to, MAPS * sizeof *to);
            again[MAPS] = nn_place(x, o->side);
            again[MAPS + 1] = nn_place(y, o->side);
        }
        memcpy(to, o->conditions + k * NN_CONDITIONS, NN_CONDITIONS * sizeof *to);
    }
}

typedef struct try_job {
    const float *maps;
    float *step, *tried;
} try_job;

/* tried = maps + step, then step encoded. */
static void try_values(const void *job, int64_t begin, int64_t end)
{
    const try_job *j = job;
    for (int64_t i = begin; i < end; i++) j->tried[i] = j->maps[i] + j->step[i];
    ts_elementwise_k()->asinh(end - begin, NN_GRADIENT_SCALE, j->step + begin, j->step + begin);
}

/* Photograph n's part of what is read. */
static bool read_one(ag_tape *tape, const nn_revision *r, const ts_tensor *gradient, const ts_tensor *conditions, int n,
                     const reading *to)
{
    enum { TOGETHER = 1 << 12 };
    ts_arena *arena = ag_arena(tape);
    const int side = r->image.shape.h, threads = ag_compute(tape)->threads;
    const size_t pixels = (size_t)side * (size_t)side;
    const rd_grid grid = rd_grid_on(rd_grid_full(side), threads);
    const float *maps = r->maps->t.data + (size_t)n * pixels * MAP_CHANNELS,
                *spread = r->spread->t.data + (size_t)n * pixels * NN_SPREADS,
                *image = r->image.data + (size_t)n * pixels * 3;
    const ts_mark mark = ts_arena_mark(arena);
    float *memory = ts_arena_alloc(arena, pixels * (9 + 2 * MAP_CHANNELS + NN_SPREADS) * sizeof *memory);
    if (!memory) return ag_fail(tape, TS_NOMEM, "no memory for a revision of %d x %d pixels", side, side), false;
    float *photo = memory, *before = photo + 3 * pixels, *after = before + 3 * pixels, *step = after + 3 * pixels,
          *tried = step + MAP_CHANNELS * pixels, *deviation = tried + MAP_CHANNELS * pixels;
    nn_deviations((int64_t)pixels, spread, (nn_belief){.scene_found = true}, threads, deviation);
    const rd_prior prior = {maps, deviation, nn_step_prior(r->known[n], 1)};
    rd_posterior_step(grid, maps, MAP_CHANNELS, &r->views[n], &image, 1, &prior, 1, NULL, step, NULL);
    ts_for(threads, (int64_t)pixels * MAP_CHANNELS, TOGETHER, try_values, &(try_job){maps, step, tried});
    rd_render(grid, maps, MAP_CHANNELS, &r->views[n], true, before);
    rd_render(grid, tried, MAP_CHANNELS, &r->views[n], true, after);
    rd_log_encode((int64_t)pixels * 3, image, photo, threads);
    rd_log_encode((int64_t)pixels * 6, before, before, threads); /* both renderings */
    const int squares = conditions->shape.h;
    ts_for(threads, squares, 1, put_rows,
           &(one){.photo = photo,
                  .before = before,
                  .after = after,
                  .maps = maps,
                  .step = step,
                  .gradient = gradient->data + (size_t)n * pixels * MAP_CHANNELS,
                  .spread = spread,
                  .conditions = conditions->data + (size_t)n * (size_t)(squares * squares) * NN_CONDITIONS,
                  .squares = to->squares->t.data +
                      (size_t)n * (size_t)(squares * squares) * (size_t)to->squares->t.shape.c,
                  .again = to->again->t.data + (size_t)n * pixels * AGAIN,
                  .side = side,
                  .r = side / squares});
    ts_arena_release(arena, mark);
    return true;
}

static bool read_all(ag_tape *tape, const nn_model *model, const nn_revision *r, reading *to)
{
    const ts_shape s = r->maps->t.shape;
    const int size = model->arch.g_size, squares = model->arch.g_unshuffle * model->arch.g_unshuffle;
    const nn_input in = {.image = r->image, .grid = rd_grid_full(s.h), .views = r->views, .given = 1};
    to->again = ag_empty(tape, (ts_shape){s.n, s.h, s.w, AGAIN});
    to->squares = ag_empty(tape, (ts_shape){s.n, size, size, squares * READ + NN_CONDITIONS});
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *gradient = ag_empty(tape, s), *conditions = nn_conditions(tape, model, &in);
    nn_state state = {0};
    if (!to->again || !to->squares || !gradient || !conditions ||
        !nn_measure_start(tape, model, &in, r->maps, &state) ||
        !nn_read(tape, model, &in, &r->maps->t, state.rmse0, gradient->t.data, NULL))
        return false;
    for (int n = 0; n < s.n; n++)
        if (!read_one(tape, r, &gradient->t, &conditions->t, n, to)) return false;
    ag_scope_end(tape, mark, NULL, 0);
    return true;
}

static ag_value *two(ag_tape *tape, const nn_model *model, const nn_layer layer[2], ag_value *x)
{
    for (int i = 0; i < 2; i++) x = nn_conv(tape, model, layer[i], x, 1, TS_PAD_ZERO, NN_LEAK_G);
    return x;
}

/* The state after it was read: [N, g_size, g_size, revise_width]. */
static ag_value *see(ag_tape *tape, const nn_model *model, ag_value *seen, ag_value *old)
{
    const nn_reviser *h = &((const nn_layers *)model->layers)->revise;
    ag_value *skip[NN_REVISE_LEVELS], *x = two(tape, model, h->read, seen);
    for (int i = 0; i < NN_REVISE_LEVELS; i++) {
        skip[i] = x;
        x = two(tape, model, h->down[i], ag_max_pool(tape, x));
    }
    x = ag_add_leaky(tape, x, nn_linear(tape, model, h->global, ag_channel_mean(tape, x)), NN_LEAK_G);
    for (int i = NN_REVISE_LEVELS; i-- > 0;)
        x = two(tape, model, h->up[i], ag_concat(tape, skip[i], ag_upsample(tape, x)));
    return ag_gru(tape, x, old, nn_parameter(tape, model, h->input.weight), nn_parameter(tape, model, h->input.bias),
                  nn_parameter(tape, model, h->hidden.weight), nn_parameter(tape, model, h->hidden.bias));
}

bool nn_revise(ag_tape *tape, const nn_model *model, nn_revision *r)
{
    const nn_reviser *h = &((const nn_layers *)model->layers)->revise;
    const int side = nn_arch_side(&model->arch);
    if (ag_status(tape)->code || !r->maps || !r->spread) return false;
    if (model->arch.revisions == 0) return ag_fail(tape, TS_INVALID, "the model has no h that revises R_0"), false;
    if (r->image.shape.h != side || r->maps->t.shape.h != side)
        return ag_fail(tape, TS_INVALID, "revisions are of %d x %d pixels, not %d", side, side, r->image.shape.h),
               false;
    const ts_mark mark = ag_scope_begin(tape);
    reading read;
    if (!read_all(tape, model, r, &read)) return false;
    const ts_mark inner = ag_scope_begin(tape);
    ag_value *state = see(tape, model, read.squares, r->state);
    ag_scope_end(tape, inner, &state, 1);
    ag_value *y = nn_conv(tape, model, h->squares, state, 1, TS_PAD_ZERO, NN_LEAK_G);
    y = ag_depth_to_space(tape, y, model->arch.g_unshuffle);
    y = nn_conv_with_constants(tape, model, h->full[0], y, read.again, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    y = nn_conv(tape, model, h->full[1], y, 1, TS_PAD_REPLICATE, 1);
    ag_value *change = ag_tanh(tape, ag_shading_frame(tape, y, MAP_CHANNELS, 0));
    ag_value *level = ag_channel_mean(tape, ag_channels(tape, change, MAP_ROUGHNESS, 4));
    ag_value *keep[3] = {ag_change_maps(tape, r->maps, change, level),
                         ag_add(tape, r->spread, ag_channels(tape, y, MAP_CHANNELS + NN_FRAME, NN_SPREADS)), state};
    if (ag_status(tape)->code) return false;
    ag_scope_end(tape, mark, keep, 3);
    r->maps = keep[0], r->spread = keep[1], r->state = keep[2];
    return true;
}

/* Counted as above, in floats a pixel of the full size. */
double nn_revision_bytes(const nn_arch *a)
{
    const double squares = (double)a->g_unshuffle * a->g_unshuffle, w = a->revise_width,
                 held = NN_REVISION_READS + AGAIN + NN_CONDITIONS / squares +
        (a->revisions - 1) * (MAP_CHANNELS + NN_SPREADS + w / squares); /* and what those before left */
    const double filling = MAP_CHANNELS + 2 * NN_CONDITIONS / squares + 9 + 2 * MAP_CHANNELS + NN_SPREADS,
                 seeing = 20 * w / squares,
                 writing = w / squares + 2 * 12 + 16 + 3 * (MAP_CHANNELS + NN_FRAME + NN_SPREADS) +
        2 * (MAP_CHANNELS + NN_SPREADS),
                 most = filling > seeing ? filling : seeing, side = nn_arch_side(a);
    return side * side * sizeof(float) * (held + (most > writing ? most : writing));
}
