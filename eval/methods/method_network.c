/* unet, unet-joint, lgd, lgd-nograd, frozen: networks that only run. They differ in the weights that they ask for. */
#include "eval/methods/method_internal.h"
#include "infer/tiles.h"
#include "tensor/maps.h"

static int photos(const ev_estimator *e)
{
    const double given = ev_given(e, "photos") ? ev_number(e, "photos") : e->net->arch.images;
    return (int)given;
}

static int steps(const ev_estimator *e)
{
    const double given = ev_number(e, "iterations");
    return given < 0 ? nn_arch_steps(&e->net->arch, photos(e)) : (int)given;
}

static ts_code open_g(ev_estimator *e, ts_status *st) { return ev_open_net(e, "model", st); }

static ts_code open_lgd(ev_estimator *e, ts_status *st)
{
    if (ev_open_net(e, "model", st) != TS_OK) return st->code;
    const nn_arch *a = &e->net->arch;
    e->last_alone = ev_ends_early(e);
    const int most = nn_most_photographs(a);
    if (ev_number(e, "sample") != 0 && a->descent != NN_DESCENT_POSTERIOR)
        return ts_fail(st, TS_UNSUPPORTED, "%s: does not guess the scene: it cannot be told what a sample is",
                       ev_text(e, "model"));
    if (photos(e) > most)
        return ts_fail(st, TS_UNSUPPORTED, "%s: reads at most %d photographs", ev_text(e, "model"), most);
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

#define LEAST_F0_OF_METAL 0.15f
enum { FEW = 50 }; /* a pixel in so many, of another kind, does not make a sample a mixed one */
enum { POWER_GIVEN, POWER_AUTO, POWER_KNOWN };
enum { VIEW_SET, VIEW_TOLD, VIEW_UNKNOWN };

/* The photographs and the field of view as the settings power and view let the method know them. */
static void photographs(const ev_estimator *e, const ev_case *c, ev_run_how *how)
{
    const int power = (int)ev_number(e, "power"), view = (int)ev_number(e, "view");
    const size_t pixels = (size_t)c->size * (size_t)c->size;
    for (int k = 0; k < how->photos; k++) {
        const float *image = (power == POWER_AUTO && c->taken ? c->taken : c->image) + (size_t)k * pixels * 3;
        if (view == VIEW_SET) ev_photo_of(&c->input[k], image, &how->photo[k]);
        else how->photo[k] = lgd_flash_photo(image);
        if (power == POWER_KNOWN) how->photo[k].power *= (float)c->exposure;
    }
    how->options.fov = view == VIEW_TOLD          ? c->fov
        : view == VIEW_SET && power != POWER_AUTO ? LGD_FOV_OF_PHOTO
                                                  : LGD_FOV_UNKNOWN;
}

/* What somebody would say of a sample with these maps: nothing where only a part of it is metal. */
static int sample_of(const io_material *truth)
{
    const int64_t pixels = (int64_t)truth->size * truth->size;
    int64_t metal = 0;
    for (int64_t i = 0; i < pixels; i++) {
        const float *m = truth->maps + i * MAP_CHANNELS;
        float diffuse = 0, f0 = 0;
        for (int c = 0; c < 3; c++) diffuse += (m[MAP_DIFFUSE + c] + 1) / 6, f0 += (m[MAP_SPECULAR + c] + 1) / 6;
        metal += f0 > LEAST_F0_OF_METAL && f0 > diffuse;
    }
    return metal >= pixels - pixels / FEW ? LGD_SAMPLE_METAL
        : metal <= pixels / FEW           ? LGD_SAMPLE_DIELECTRIC
                                          : LGD_SAMPLE_UNKNOWN;
}

/* As lgd-infer estimates. */
static ts_code run_lgd(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    double factor;
    ev_run_how how = {.photos = ev_inputs(e, c),
                      .options = {.iterations = steps(e),
                                  .precision = (int)ev_number(e, "precision"),
                                  .tolerance = ev_number(e, "tolerance"),
                                  .power = (int)ev_number(e, "power") == POWER_AUTO ? &factor : NULL}};
    photographs(e, c, &how);
    if (c->truth && ev_number(e, "sample") != 0) how.options.sample = sample_of(c->truth);
    return ev_run(e, c, &how, seen, user, st);
}

/* What g says of the first photograph, told as much of camera and light as run_lgd is. */
static ts_code run_g(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    double factor;
    ev_run_how how = {
        .photos = 1, .options.power = (int)ev_number(e, "power") == POWER_AUTO ? &factor : NULL, .g_alone = true};
    photographs(e, c, &how);
    return ev_run(e, c, &how, seen, user, st);
}

#define MODEL_GIVEN(text)                                \
    {                                                    \
        .key = "model", .type = EV_WEIGHTS, .help = text \
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

#define PHOTOS                                                           \
    {                                                                    \
        .key = "photos", .type = EV_WHOLE, .lo = 1, .hi = NN_MAX_IMAGES, \
        .help = "number of photographs (default: as many as g reads)"    \
    }
#define POWER                                                                                                       \
    {                                                                                                               \
        .key = "power", .type = EV_WORD, .words = "given auto known", .initial = "given",                           \
        .help =                                                                                                     \
            "of the light: given = the default, auto = as lgd-infer --light-power auto, known = that of --exposure" \
    }
#define VIEW                                                                                                        \
    {                                                                                                               \
        .key = "view", .type = EV_WORD, .words = "set told unknown", .initial = "set",                              \
        .help = "of the camera: set = its place as the set has it (with power=auto taken for a guess), told = its " \
                "field of view alone, as lgd-infer --fov, unknown = nothing"                                        \
    }
#define PRECISION                                                                   \
    {                                                                               \
        .key = "precision", .type = EV_WORD, .words = "f32 bf16", .initial = "f32", \
        .help = "of the products in convolutions, as lgd-infer --precision"         \
    }
#define SAMPLE                                                                                                        \
    {                                                                                                                 \
        .key = "sample", .type = EV_WORD, .words = "auto told", .initial = "auto",                                    \
        .help = "told = whether it is metal or dielectric, as lgd-infer --sample, of materials that are one all over" \
    }
#define REFINER \
    ITERATIONS, TOLERANCE, EV_ORIENTATIONS, PHOTOS, POWER, VIEW, PRECISION, SAMPLE, { 0 }

static const ev_setting unet[] = {MODEL_GIVEN("weights of a g that was trained alone"), POWER, VIEW, {0}};
static const ev_setting joint[] = {
    EV_MODEL("model", "weights of g and h (default: the program's)"), EV_ORIENTATIONS, POWER, VIEW, {0}};
static const ev_setting lgd[] = {EV_MODEL("model", "weights of g and h (default: the program's)"), REFINER};
static const ev_setting nograd[] = {MODEL_GIVEN("weights trained with model.gradient = no"), REFINER};
static const ev_setting frozen[] = {MODEL_GIVEN("weights trained with train.g_rate = 0"), REFINER};

const ev_method ev_method_unet = {
    .name = "unet", .help = "g alone, feed-forward", .settings = unet, .open = open_g, .run = run_g};
const ev_method ev_method_unet_joint = {.name = "unet-joint",
                                        .help = "what g says that was trained with h or steps",
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
