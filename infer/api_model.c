/* The public C API (infer/lgd.h): models and who computes with them, and what a caller may get wrong. */
#include "infer/api_model.h"
#include "infer/api.h"
#include "infer/estimate.h"
#include "infer/tiles.h"
#include "nn/weights/file.h"
#include "nn/weights/weights.h"
#include "render/render.h"
#include "tensor/maps.h"
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    ITERATIONS_MAX = 1000, /* a larger number is a mistake: nothing changes after some ten */
    OPTIONS_LEAST = offsetof(lgd_options, iterations) + sizeof(int) /* a size below has no option at all */
};

/* What a call computes in. */
typedef struct workspace {
    ag_tape *tape;
    struct workspace *next;
} workspace;

struct lgd_model {
    nn_model *net;
    ag_tape *first; /* whose packed weights all share: in one of the workspaces */
    pthread_mutex_t lock;
    workspace *idle;
};

const char *lgd_version(void) { return LGD_VERSION; }

void lgd_options_init(lgd_options *options, size_t size)
{
    const lgd_options o = {
        .size = size, .iterations = -1, .orientations = LGD_ORIENTATIONS_DEFAULT, .tolerance = LGD_TOLERANCE_DEFAULT};
    memset(options, 0, size);
    memcpy(options, &o, size < sizeof o ? size : sizeof o);
}

int lgd_trained_iterations(const lgd_model *model) { return model->net->arch.iterations; }

int lgd_usual_iterations(const lgd_model *model, int photos) { return nn_arch_steps(&model->net->arch, photos); }

uint64_t lgd_model_hash(const lgd_model *model) { return nn_file_hash(model->net->file); }

void lgd_model_single(lgd_model *model) { model->net->g_once = true; }

int lgd_published(const lgd_model *model) { return model->net->arch.compat == NN_COMPAT_PUBLISHED; }

int lgd_most_photos(const lgd_model *model) { return nn_most_photographs(&model->net->arch); }

lgd_photo lgd_flash_photo(const float *image)
{
    const rd_view flash = rd_flash();
    lgd_photo p = {.image = image, .power = flash.power};
    memcpy(p.light, flash.light, sizeof p.light);
    memcpy(p.camera, flash.camera, sizeof p.camera);
    return p;
}

const char *lgd_fov_assumption(const lgd_photo *taken)
{
    return taken->camera[2] == lgd_flash_photo(NULL).camera[2] ? "assumed: " : "estimated: ";
}

static workspace *make_workspace(ag_tape *tape, ts_status *st)
{
    workspace *w = tape ? malloc(sizeof *w) : NULL;
    if (w) *w = (workspace){tape, NULL};
    else if (tape) {
        ts_fail(st, TS_NOMEM, "out of memory");
        ag_tape_destroy(&tape);
    }
    return w;
}

/* An idle one, or where all are in use a new one. NULL and st on failure. */
static workspace *take(lgd_model *model, ts_status *st)
{
    pthread_mutex_lock(&model->lock);
    workspace *w = model->idle;
    if (w) model->idle = w->next;
    pthread_mutex_unlock(&model->lock);
    return w ? w : make_workspace(ag_tape_sharing(model->first, st), st);
}

static void give_back(lgd_model *model, workspace *w)
{
    pthread_mutex_lock(&model->lock);
    w->next = model->idle;
    model->idle = w;
    pthread_mutex_unlock(&model->lock);
}

lgd_model *lgd_load(const char *weights, lgd_error *error)
{
    ts_status st = {0};
    lgd_model *model = NULL;
    if (!weights) ts_fail(&st, TS_INVALID, "lgd_load: no weights file is given");
    else if (!(model = calloc(1, sizeof *model))) ts_fail(&st, TS_NOMEM, "%s: out of memory", weights);
    else {
        *model = (lgd_model){.lock = PTHREAD_MUTEX_INITIALIZER, .net = nn_model_open(weights, &st)};
        if (model->net) model->idle = make_workspace(ag_tape_create(false, &st), &st);
        if (model->idle) {
            ag_freeze(model->first = model->idle->tape, true);
            ag_halves_from(model->first, nn_model_halves, model->net);
        }
    }
    if (st.code) lgd_free(&model);
    lgd_report(error, &st);
    return model;
}

void lgd_free(lgd_model **model)
{
    if (!model || !*model) return;
    for (workspace *w = (*model)->idle, *next; w; w = next) {
        next = w->next;
        ag_tape_destroy(&w->tape);
        free(w);
    }
    pthread_mutex_destroy(&(*model)->lock);
    nn_model_free(&(*model)->net);
    free(*model);
    *model = NULL;
}

static bool apart(const lgd_photo *p)
{
    return p->light[0] != p->camera[0] || p->light[1] != p->camera[1] || p->light[2] != p->camera[2];
}

static ts_code check_photo(const lgd_model *model, const lgd_photo *p, int number, ts_status *st)
{
    if (!p->image) return ts_fail(st, TS_INVALID, "lgd_estimate: photograph %d has no image", number);
    if (!lgd_photo_can_be(p))
        return ts_fail(st, TS_INVALID,
                       "lgd_estimate: light and camera of photograph %d must be above the sample, its power above 0",
                       number);
    if (lgd_published(model) && apart(p))
        return ts_fail(st, TS_UNSUPPORTED,
                       "lgd_estimate: %s: the published weights know light and camera at one place: those of "
                       "photograph %d are apart",
                       nn_file_path(model->net->file), number);
    return TS_OK;
}

static ts_code check_fov(double fov, int photos, ts_status *st)
{
    if (fov == LGD_FOV_UNKNOWN || fov == LGD_FOV_OF_PHOTO) return TS_OK;
    if (!(fov >= LGD_FOV_LEAST && fov <= LGD_FOV_MOST))
        return ts_fail(st, TS_INVALID,
                       "lgd_estimate: fov is %g and must lie in %g .. %g degrees, or be %g for unknown or %g for the "
                       "photograph's",
                       fov, LGD_FOV_LEAST, LGD_FOV_MOST, LGD_FOV_UNKNOWN, LGD_FOV_OF_PHOTO);
    if (photos > 1)
        return ts_fail(st, TS_INVALID, "lgd_estimate: fov is of one photograph: of %d, each names its camera", photos);
    return TS_OK;
}

ts_code lgd_model_takes(const lgd_model *model, const lgd_options *o, ts_status *st)
{
    const char *weights = nn_file_path(model->net->file);
    if (o->sample != LGD_SAMPLE_UNKNOWN && model->net->arch.descent != NN_DESCENT_POSTERIOR)
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: these weights do not guess the scene: they cannot be told what the sample is", weights);
    if ((o->tolerance > 0 || o->mask) && !lgd_tiles_exact(&model->net->arch))
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: these weights' loss is taken anew over the whole photograph at every step: no mask and no "
                       "tolerance",
                       weights);
    if (o->iterations > 0 && !nn_arch_refines(&model->net->arch))
        return ts_fail(st, TS_UNSUPPORTED, "%s: these weights have no refiner: only 0 iterations are possible",
                       weights);
    return TS_OK;
}

static ts_code check_arguments(const lgd_model *model, const lgd_photo *photo, int photos, int side,
                               const lgd_options *o, const float *maps, ts_status *st)
{
    if (!model || !photo || !maps) return ts_fail(st, TS_INVALID, "lgd_estimate: model, image and maps must be given");
    if (photos < 1 || photos > nn_most_photographs(&model->net->arch))
        return ts_fail(st, TS_INVALID, "lgd_estimate: %d photographs: these weights read 1 .. %d", photos,
                       nn_most_photographs(&model->net->arch));
    for (int k = 0; k < photos; k++)
        if (check_photo(model, &photo[k], k + 1, st) != TS_OK) return st->code;
    if (side < 1 || side > LGD_SIDE_MAX)
        return ts_fail(st, TS_INVALID, "lgd_estimate: side is %d and must lie in 1 .. %d", side, LGD_SIDE_MAX);
    if (o->iterations < LGD_AUTO || o->iterations > ITERATIONS_MAX)
        return ts_fail(
            st, TS_INVALID,
            "lgd_estimate: iterations is %d and must lie in 0 .. %d, or be -1 for as usual or %d for automatic",
            o->iterations, ITERATIONS_MAX, LGD_AUTO);
    if (o->threads < 0 || o->threads > LGD_THREADS_MAX)
        return ts_fail(st, TS_INVALID, "lgd_estimate: threads is %d and must lie in 1 .. %d, or be 0 for all",
                       o->threads, LGD_THREADS_MAX);
    if (!(o->tolerance >= 0 && o->tolerance <= 1) && o->tolerance != LGD_TOLERANCE_DEFAULT)
        return ts_fail(st, TS_INVALID, "lgd_estimate: tolerance is %g and must lie in 0 .. 1, or be %g for the default",
                       o->tolerance, LGD_TOLERANCE_DEFAULT);
    if (o->precision != LGD_F32 && o->precision != LGD_BF16)
        return ts_fail(st, TS_INVALID, "lgd_estimate: precision is %d and must be %d for f32 or %d for bf16",
                       o->precision, LGD_F32, LGD_BF16);
    if (o->orientations != 0 && o->orientations != 1 && o->orientations != 2 && o->orientations != 4 &&
        o->orientations != 8)
        return ts_fail(st, TS_INVALID,
                       "lgd_estimate: orientations is %d and must be 1, 2, 4 or 8, or 0 as suits the model",
                       o->orientations);
    if (check_fov(o->fov, photos, st) != TS_OK) return st->code;
    if (o->sample != LGD_SAMPLE_UNKNOWN && o->sample != LGD_SAMPLE_DIELECTRIC && o->sample != LGD_SAMPLE_METAL)
        return ts_fail(st, TS_INVALID, "lgd_estimate: sample is %d and must be one of LGD_SAMPLE_...", o->sample);
    return lgd_model_takes(model, o, st) == TS_OK ? TS_OK : ts_context(st, "lgd_estimate");
}

ts_code lgd_model_estimate(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *options,
                           bool encoded, float *maps, ts_status *st)
{
    lgd_options o = lgd_options_default();
    if (lgd_take_struct("lgd_estimate", options, OPTIONS_LEAST, &o, sizeof o, st) != TS_OK ||
        check_arguments(model, photo, photos, side, &o, maps, st) != TS_OK)
        return st->code;
    workspace *w = take(model, st);
    if (!w) return st->code;
    const lgd_estimator e = {.net = model->net, .tape = w->tape, .encoded = encoded};
    lgd_estimator_run(&e, photo, photos, side, &o, maps, st);
    give_back(model, w);
    return st->code;
}

double lgd_model_bytes(const lgd_model *model, int side, const lgd_options *options)
{
    const lgd_estimator e = {.net = model->net};
    return lgd_estimator_bytes(&e, side, options);
}

int lgd_estimate_photos(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *options,
                        float *maps, lgd_error *error)
{
    ts_status st = {0};
    lgd_model_estimate(model, photo, photos, side, options, false, maps, &st);
    return lgd_report(error, &st);
}

int lgd_estimate(lgd_model *model, const float *image, int side, const lgd_options *options, float *maps,
                 lgd_error *error)
{
    const lgd_photo photo = lgd_flash_photo(image);
    return lgd_estimate_photos(model, &photo, 1, side, options, maps, error);
}

int lgd_render(const float *maps, int side, const float light[3], const float camera[3], float power, float *image,
               lgd_error *error)
{
    ts_status st = {0};
    rd_view view = {.kind = RD_POINT, .power = power};
    bool finite = isfinite(power);
    if (!maps || !light || !camera || !image) {
        ts_fail(&st, TS_INVALID, "lgd_render: maps, light, camera and image must be given");
        return lgd_report(error, &st);
    }
    for (int i = 0; i < 3; i++) {
        view.light[i] = light[i];
        view.camera[i] = camera[i];
        finite = finite && isfinite(light[i]) && isfinite(camera[i]);
    }
    if (!finite || power < 0)
        ts_fail(&st, TS_INVALID, "lgd_render: light, camera and power must be finite and power not negative");
    else if (side < 1 || side > LGD_SIDE_MAX)
        ts_fail(&st, TS_INVALID, "lgd_render: side is %d and must lie in 1 .. %d", side, LGD_SIDE_MAX);
    if (st.code) return lgd_report(error, &st);

    const size_t pixels = (size_t)side * (size_t)side;
    float *encoded = malloc(pixels * MAP_CHANNELS * sizeof *encoded);
    if (!encoded) {
        ts_fail(&st, TS_NOMEM, "lgd_render: out of memory for %d x %d pixels", side, side);
        return lgd_report(error, &st);
    }
    lgd_encode(maps, side, 0, encoded);
    rd_render(rd_grid_full(side), encoded, MAP_CHANNELS, &view, false, image);
    free(encoded);
    return lgd_report(error, &st);
}
