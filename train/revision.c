/* The second phase of a model with arch.revisions: h learns to revise what a fixed g and the steps make of several
 * photographs. */
#include "nn/first_guess.h"
#include "nn/lattice.h"
#include "nn/metal.h"
#include "nn/revise.h"
#include "ops.h"
#include "render/losses.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include "train/disturb.h"
#include "train/state.h"
#include <string.h>

/* The first guess of material n, in place of what g said of its first photograph; views: of all, which are found. */
static bool settle(ag_tape *tape, const nn_model *model, const nn_input *in, const nn_guess *said, int n,
                   rd_view *views)
{
    const int side = in->image.shape.h, channels = model->arch.channels, given = in->given,
              known = in->known[n * given];
    const int64_t pixels = (int64_t)side * side;
    const rd_grid grid = rd_grid_on(rd_grid_full(side), ag_compute(tape)->threads);
    const nn_taken taken = {.view = views[0], .known = known, .photographs = given};
    const float *image[NN_MAX_IMAGES];
    ts_arena *arena = ag_arena(tape);
    ts_status st = {0};
    for (int k = 0; k < given; k++) image[k] = in->image.data + (n * given + k) * pixels * 3;
    const ts_mark mark = ts_arena_mark(arena);
    nn_first_guess guess = {.r0 = said->maps->t.data + n * pixels * channels,
                            .spread = said->spread->t.data + n * pixels * NN_SPREADS,
                            .deviation = ts_arena_alloc(arena, (size_t)pixels * NN_SPREADS * sizeof(float))};
    if (!guess.deviation) return ag_fail(tape, TS_NOMEM, "no memory for the maps' deviations"), false;
    ts_code code = nn_first_guess_settle(
        grid, channels, image[0], said->scene->t.data + (size_t)n * 2 * RD_SCENE_NUMBERS, &taken, arena, &guess, &st);
    views[0] = guess.view;
    const nn_photos photos = {image, views, given, side, known};
    if (!code)
        code = nn_tell_metal(grid, &photos, guess.deviation, nn_arch_steps(&model->arch, given), channels, guess.r0,
                             &st);
    if (code) ag_fail(tape, st.code, "%s", st.message);
    ts_arena_release(arena, mark);
    return !code;
}

typedef struct disturbing {
    const tr_trainer *t;
    float *maps;
    int side;
} disturbing;

static void disturb_one(const void *job, int64_t i)
{
    const disturbing *j = job;
    const tr_trainer *t = j->t;
    const tr_config *c = &t->config;
    const uint64_t index = (uint64_t)t->step * (uint64_t)c->train.batch + (uint64_t)(t->first + i);
    tr_disturb(c->train.disturb, (uint64_t)c->train.seed, index, j->side,
               j->maps + i * j->side * j->side * MAP_CHANNELS);
}

/* As nn_first_guess does. */
static bool take_lattices(ag_tape *tape, const nn_model *model, ag_value *maps)
{
    const int period = model->arch.g_unshuffle, side = nn_arch_side(&model->arch), channels = model->arch.channels;
    ts_status st = {0};
    for (int n = 0; period > 1 && n < maps->t.shape.n; n++)
        if (nn_take_lattice(period, side, channels, ag_compute(tape)->threads, ag_arena(tape),
                            maps->t.data + (size_t)n * (size_t)side * (size_t)side * (size_t)channels, &st) != TS_OK)
            return ag_fail(tape, st.code, "%s", st.message), false;
    return true;
}

bool tr_first_guesses(ag_tape *tape, const nn_model *model, const nn_input *in, const tr_trainer *disturbed,
                      nn_revision *r)
{
    const int given = in->given, count = in->image.shape.n / given, side = nn_arch_side(&model->arch);
    const size_t values = (size_t)side * (size_t)side * 3;
    ts_arena *arena = ag_arena(tape);
    rd_view *views = ts_arena_alloc(arena, (size_t)(count * given) * sizeof *views),
            *own = ts_arena_alloc(arena, (size_t)count * sizeof *own);
    unsigned char *known = ts_arena_alloc(arena, (size_t)count);
    ag_value *first = ag_empty(tape, (ts_shape){count, side, side, 3});
    nn_guess said;
    if (!views || !own || !known) ag_fail(tape, TS_NOMEM, "no memory for the scenes that are found");
    if (ag_status(tape)->code) return false;
    memcpy(views, in->views, (size_t)(count * given) * sizeof *views);
    for (int n = 0; n < count; n++) {
        own[n] = in->views[n * given], known[n] = in->known[n * given];
        memcpy(first->t.data + (size_t)n * values, in->image.data + (size_t)(n * given) * values,
               values * sizeof(float));
    }
    const nn_input read = {.image = first->t, .grid = in->grid, .views = own, .known = known, .given = 1};
    if (!nn_guess_from(tape, model, &read, &said) || !take_lattices(tape, model, said.maps)) return false;
    if (disturbed && disturbed->config.train.disturb > 0)
        ts_tasks(0, count, disturb_one, &(disturbing){disturbed, said.maps->t.data, side});
    for (int n = 0; n < count; n++)
        if (!settle(tape, model, in, &said, n, views + n * given)) return false;
    *r = (nn_revision){.given = given,
                       .image = in->image,
                       .views = views,
                       .known = in->known,
                       .maps = ag_constant(tape, said.maps->t),
                       .spread = ag_constant(tape, said.spread->t)};
    return r->maps && r->spread;
}

ag_value *tr_revision_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row)
{
    const tr_config *c = &t->config;
    const int revisions = c->arch.revisions;
    ag_tape *tape = t->tape;
    nn_revision r;
    ag_value *loss = NULL;
    ag_reset(t->quiet);
    ag_compute_set(t->quiet, (ts_compute){.exact = c->train.exact, .precision = c->train.precision});
    if (!tr_first_guesses(t->quiet, t->model, in, t, &r))
        return ag_fail(tape, ag_status(t->quiet)->code, "%s", ag_status(t->quiet)->message);
    r.maps = ag_constant(tape, r.maps->t), r.spread = ag_constant(tape, r.spread->t);
    row->iterations = revisions;
    for (int k = 0; k < revisions; k++) {
        if (!nn_revise(tape, t->model, &r)) return NULL;
        loss = tr_add_loss(t, loss, r.maps, target, 1, &row->render_end, &row->map_end);
        ag_value *unlikely = ag_laplace(tape, ag_constant(tape, r.maps->t), r.spread, target, nn_spread_of,
                                        NN_SPREAD_UNIT);
        if (unlikely) row->spread = (double)unlikely->t.data[0];
        loss = ag_add(tape, loss, ag_scale(tape, unlikely, (float)c->train.spread_weight));
    }
    return revisions > 1 ? ag_scale(tape, loss, 1 / (float)revisions) : loss;
}
