/* unet, unet-joint, lgd, lgd-nograd, frozen: networks that only run. They differ in the weights that they ask for. */
#include "eval/methods/method.h"
#include "infer/power.h"
#include "infer/tiles.h"
#include "tensor/conv/conv.h"
#include <stdlib.h>
#include <string.h>

enum {
    UNTILED = 512,
    TILE = 256
}; /* as lgd-infer's where a tolerance ends tiles early: up to the first the whole is one */

static int steps(const ev_estimator *e)
{
    const double told = ev_number(e, "iterations");
    return told < 0 ? e->net->arch.iterations : (int)told;
}

static int photos(const ev_estimator *e)
{
    const double told = ev_given(e, "photos") ? ev_number(e, "photos") : e->net->arch.images;
    return (int)told;
}

static ts_code open_g(ev_estimator *e, ts_status *st) { return ev_open_net(e, "model", st); }

static ts_code open_lgd(ev_estimator *e, ts_status *st)
{
    if (ev_open_net(e, "model", st) != TS_OK) return st->code;
    const nn_arch *a = &e->net->arch;
    e->last_alone = ev_number(e, "tolerance") > 0;
    if (photos(e) > a->images)
        return ts_fail(st, TS_UNSUPPORTED, "%s: reads at most %d photographs", ev_text(e, "model"), a->images);
    if (steps(e) > 0 && !nn_arch_refines(a))
        return ts_fail(st, TS_UNSUPPORTED, "%s: has no refiner: only iterations 0 are possible", ev_text(e, "model"));
    if (e->last_alone && !lgd_tiles_exact(a))
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: its steps couple all pixels, so that no tolerance can end a part of them",
                       ev_text(e, "model"));
    return TS_OK;
}

static ts_code open_nograd(ev_estimator *e, ts_status *st)
{
    if (open_lgd(e, st) != TS_OK) return st->code;
    if (e->net->arch.gradient)
        return ts_fail(st, TS_UNSUPPORTED, "%s: was trained with the gradient (model.gradient = yes)",
                       ev_text(e, "model"));
    return TS_OK;
}

static ts_code run_g(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    if (ev_block(e, (size_t)c->size * (size_t)c->size * MAP_CHANNELS, st) != TS_OK ||
        ev_start_r0(e, c, e->x, st) != TS_OK)
        return st->code;
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

enum { POWER_TOLD, POWER_AUTO, POWER_KNOWN };

/* The inputs' pictures and views, with the lights' power as the key says; *proposed: R_0 where that needed it (the
 * caller frees it), else NULL. */
static ts_code inputs(ev_estimator *e, const ev_case *c, const float *image[NN_MAX_IMAGES], rd_view view[NN_MAX_IMAGES],
                      float **proposed, ts_status *st)
{
    *proposed = NULL;
    double factor = (int)ev_number(e, "power") == POWER_KNOWN ? c->exposure : 1;
    const int count = photos(e);
    for (int k = 0; k < count; k++) {
        image[k] = c->image + (size_t)k * (size_t)c->size * (size_t)c->size * 3;
        view[k] = c->input[k];
    }
    if ((int)ev_number(e, "power") == POWER_AUTO) {
        const size_t size = (size_t)e->net->arch.g_size;
        *proposed = malloc(size * size * (size_t)e->net->arch.channels * sizeof **proposed);
        if (!*proposed) return ts_fail(st, TS_NOMEM, "out of memory");
        if (lgd_fit_power(e->tape, e->net, image, view, count, c->size, ev_orientations(e), *proposed, &factor, st) !=
            TS_OK)
            return st->code;
    }
    for (int k = 0; k < count; k++) view[k].power *= (float)factor;
    return TS_OK;
}

static ts_code run_tiles(ev_estimator *e, const ev_case *c, const float *const *image, const rd_view *view,
                         const float *proposed, ev_seen seen, void *user, ts_status *st)
{
    const int channels = e->net->arch.channels;
    if (ev_block(e, (size_t)c->size * (size_t)c->size * (size_t)channels, st) != TS_OK) return st->code;
    lgd_tiles t = {.image = image,
                   .views = view,
                   .given = photos(e),
                   .side = c->size,
                   .tile = c->size > UNTILED ? TILE : c->size,
                   .steps = steps(e),
                   .orientations = ev_orientations(e),
                   .proposed = proposed,
                   .tolerance = ev_number(e, "tolerance")};
    if (lgd_tiles_run(e->tape, e->net, &t, e->x, st) != TS_OK) return st->code;
    seen(t.steps, e->x, channels, user);
    return TS_OK;
}

static ts_code run_whole(ev_estimator *e, const ev_case *c, const rd_view *view, const float *proposed, ev_seen seen,
                         void *user, ts_status *st)
{
    told t = {seen, user};
    ag_value *out = NULL;
    ag_reset(e->tape);
    const int given = photos(e);
    const nn_input in = {.image = ts_view((float *)(uintptr_t)c->image, (ts_shape){given, c->size, c->size, 3}),
                         .grid = rd_grid_full(c->size),
                         .views = view,
                         .given = given,
                         .orientations = ev_orientations(e),
                         .proposed = proposed};
    if (nn_lgd(e->tape, e->net, &in, steps(e), false, &out, &(nn_watch){after, &t, false}) == TS_OK) return TS_OK;
    *st = *ag_status(e->tape);
    return st->code;
}

static ts_code refine(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const float *image[NN_MAX_IMAGES];
    rd_view view[NN_MAX_IMAGES];
    float *proposed;
    ts_code code = inputs(e, c, image, view, &proposed, st);
    if (!code)
        code = e->last_alone ? run_tiles(e, c, image, view, proposed, seen, user, st)
                             : run_whole(e, c, view, proposed, seen, user, st);
    free(proposed);
    return code;
}

static ts_code run_lgd(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    ag_compute_set(e->tape, (ts_compute){.exact = e->exact, .precision = (ts_precision)ev_number(e, "precision")});
    return refine(e, c, seen, user, st);
}

#define MODEL_GIVEN(text)                                \
    {                                                    \
        .key = "model", .type = EV_WEIGHTS, .help = text \
    }
#define MODEL(text)                                                     \
    {                                                                   \
        .key = "model", .type = EV_WEIGHTS, .initial = "", .help = text \
    }
#define ITERATIONS                                                                                 \
    {                                                                                              \
        .key = "iterations", .type = EV_WHOLE, .lo = 0, .hi = 1000,                                \
        .grid = "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24", .steps = true, \
        .help = "refinement steps T (default: as trained)"                                         \
    }
#define TOLERANCE                                                              \
    {                                                                          \
        .key = "tolerance", .type = EV_REAL, .lo = 0, .hi = 1, .initial = "0", \
        .help = "early stop of a tile, as lgd-infer --tolerance"               \
    }

static const ev_setting unet[] = {MODEL_GIVEN("weights of a g that was trained alone"), {0}};
static const ev_setting joint[] = {MODEL("weights of g and h (default: the program's)"), EV_ORIENTATIONS, {0}};
#define PHOTOS                                                                \
    {                                                                         \
        .key = "photos", .type = EV_WHOLE, .lo = 1, .hi = NN_MAX_IMAGES,      \
        .help = "number of photographs (default: as many as the model reads)" \
    }
#define POWER                                                                                                          \
    {                                                                                                                  \
        .key = "power", .type = EV_WORD, .words = "told auto known", .initial = "told",                                \
        .help = "of the light: told = the default, auto = as lgd-infer --light-power auto, known = that of --exposure" \
    }
#define PRECISION                                                                   \
    {                                                                               \
        .key = "precision", .type = EV_WORD, .words = "f32 bf16", .initial = "f32", \
        .help = "of the products in convolutions, as lgd-infer --precision"         \
    }
#define REFINER \
    ITERATIONS, TOLERANCE, EV_ORIENTATIONS, PHOTOS, POWER, PRECISION, { 0 }

static const ev_setting lgd[] = {MODEL("weights of g and h (default: the program's)"), REFINER};
static const ev_setting nograd[] = {MODEL_GIVEN("weights trained with model.gradient = no"), REFINER};
static const ev_setting frozen[] = {MODEL_GIVEN("weights trained with train.g_rate = 0"), REFINER};

const ev_method ev_method_unet = {
    .name = "unet", .help = "g alone, feed-forward", .settings = unet, .open = open_g, .run = run_g};
const ev_method ev_method_unet_joint = {.name = "unet-joint",
                                        .help = "R_0 of g and h that were trained together",
                                        .settings = joint,
                                        .open = open_g,
                                        .run = run_g};
const ev_method ev_method_lgd = {.name = "lgd",
                                 .help = "g, then refinement steps that read the gradient",
                                 .settings = lgd,
                                 .steps = steps,
                                 .photos = photos,
                                 .open = open_lgd,
                                 .run = run_lgd};
const ev_method ev_method_lgd_nograd = {.name = "lgd-nograd",
                                        .help = "g and an h that was trained without the gradient",
                                        .settings = nograd,
                                        .steps = steps,
                                        .photos = photos,
                                        .open = open_nograd,
                                        .run = run_lgd};
const ev_method ev_method_frozen = {.name = "frozen",
                                    .help = "g and an h that was trained over a fixed g",
                                    .settings = frozen,
                                    .steps = steps,
                                    .photos = photos,
                                    .open = open_lgd,
                                    .run = run_lgd};
