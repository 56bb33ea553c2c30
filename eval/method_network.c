/* unet, unet-joint, lgd, lgd-nograd, frozen: networks that only run. They differ in the weights that they ask for. */
#include "eval/method.h"
#include "infer/tiles.h"
#include <string.h>

enum { UNTILED = 512, TILE = 128 }; /* as lgd-infer's where a tolerance ends tiles early: up to the first the whole is one */

static int steps(const ev_estimator *e)
{
    const double told = ev_number(e, "iterations");
    return told < 0 ? e->net->arch.iterations : (int)told;
}

static ts_code open_g(ev_estimator *e, ts_status *st) { return ev_open_net(e, "model", st); }

static ts_code open_lgd(ev_estimator *e, ts_status *st)
{
    if (ev_open_net(e, "model", st) != TS_OK) return st->code;
    const nn_arch *a = &e->net->arch;
    e->last_alone = ev_number(e, "tolerance") > 0;
    if (steps(e) > 0 && a->h_width == 0) return ts_fail(st, TS_UNSUPPORTED, "%s: has no refiner: only iterations 0 are possible", ev_text(e, "model"));
    if (e->last_alone && !lgd_tiles_exact(a)) return ts_fail(st, TS_UNSUPPORTED, "%s: its steps couple all pixels, so that no tolerance can end a part of them", ev_text(e, "model"));
    return TS_OK;
}

static ts_code open_nograd(ev_estimator *e, ts_status *st)
{
    if (open_lgd(e, st) != TS_OK) return st->code;
    if (e->net->arch.gradient) return ts_fail(st, TS_UNSUPPORTED, "%s: was trained with the gradient (model.gradient = yes)", ev_text(e, "model"));
    return TS_OK;
}

static ts_code run_g(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    if (ev_block(e, (size_t)c->size * (size_t)c->size * MAP_CHANNELS, st) != TS_OK || ev_start_r0(e, c, e->x, st) != TS_OK) return st->code;
    seen(0, e->x, MAP_CHANNELS, user);
    return TS_OK;
}

typedef struct told {
    ev_seen seen;
    void *user;
} told;

static bool after(int step, const ag_value *maps, void *user)
{
    const told *t = user;
    return t->seen(step, maps->t.data, maps->t.shape.c, t->user);
}

static ts_code run_tiles(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const int channels = e->net->arch.channels;
    if (ev_block(e, (size_t)c->size * (size_t)c->size * (size_t)channels, st) != TS_OK) return st->code;
    lgd_tiles t = {.image = &c->image, .views = &c->view, .given = 1, .side = c->size, .tile = c->size > UNTILED ? TILE : c->size, .steps = steps(e), .tolerance = ev_number(e, "tolerance")};
    if (lgd_tiles_run(e->tape, e->net, &t, e->x, st) != TS_OK) return st->code;
    seen(t.steps, e->x, channels, user);
    return TS_OK;
}

static ts_code run_lgd(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    if (e->last_alone) return run_tiles(e, c, seen, user, st);
    told t = {seen, user};
    ag_value *out = NULL;
    ag_reset(e->tape);
    const nn_input in = {.image = ts_view((float *)(uintptr_t)c->image, (ts_shape){1, c->size, c->size, 3}), .grid = rd_grid_full(c->size), .view = c->view};
    if (nn_lgd(e->tape, e->net, &in, steps(e), false, &out, after, &t) == TS_OK) return TS_OK;
    *st = *ag_status(e->tape);
    return st->code;
}

#define MODEL_GIVEN(text) {.key = "model", .type = EV_WEIGHTS, .help = text}
#define MODEL(text) {.key = "model", .type = EV_WEIGHTS, .initial = "", .help = text}
#define ITERATIONS                                                                                                                        \
    {.key = "iterations", .type = EV_WHOLE, .lo = 0, .hi = 1000, .grid = "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24", \
     .steps = true, .help = "refinement steps T (default: as trained)"}
#define TOLERANCE {.key = "tolerance", .type = EV_REAL, .lo = 0, .hi = 1, .initial = "0", .help = "tiles end when a step changes them less, as lgd-infer --tolerance"}

static const ev_setting unet[] = {MODEL_GIVEN("weights of a g that was trained alone"), {0}};
static const ev_setting joint[] = {MODEL("weights of g and h, by default the program's"), {0}};
static const ev_setting lgd[] = {MODEL("weights of g and h, by default the program's"), ITERATIONS, TOLERANCE, {0}};
static const ev_setting nograd[] = {MODEL_GIVEN("weights trained with model.gradient = no"), ITERATIONS, TOLERANCE, {0}};
static const ev_setting frozen[] = {MODEL_GIVEN("weights trained with train.g_rate = 0"), ITERATIONS, TOLERANCE, {0}};

const ev_method ev_method_unet = {.name = "unet", .help = "g alone, feed-forward", .settings = unet, .open = open_g, .run = run_g};
const ev_method ev_method_unet_joint = {.name = "unet-joint", .help = "R_0 of g and h that were trained together", .settings = joint, .open = open_g, .run = run_g};
const ev_method ev_method_lgd = {.name = "lgd", .help = "g and h, which reads the gradient", .settings = lgd, .steps = steps, .open = open_lgd, .run = run_lgd};
const ev_method ev_method_lgd_nograd = {.name = "lgd-nograd", .help = "g and h that was trained without the gradient", .settings = nograd, .steps = steps, .open = open_nograd, .run = run_lgd};
const ev_method ev_method_frozen = {.name = "frozen", .help = "h that was trained on a fixed g", .settings = frozen, .steps = steps, .open = open_lgd, .run = run_lgd};
