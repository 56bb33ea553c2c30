/* The public C API (infer/lgd.h): checks what a caller may get wrong, runs the unrolled loop, and turns the network's
 * encoding into the values that the header promises. */
#include "infer/lgd.h"
#include "data/material.h"
#include "infer/clip.h"
#include "infer/encode.h"
#include "infer/memory.h"
#include "infer/power.h"
#include "infer/tiles.h"
#include "nn/model.h"
#include "nn/weights.h"
#include "render/render.h"
#include "tensor/resize.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SIDE_MAX = 16384,     /* 9.7 GB of maps: a larger number is a mistake */
    ITERATIONS_MAX = 1000, /* the same: nothing changes after some ten */
    THREADS_MAX = 1024,
    UNTILED = 512,         /* pixels a side up to which a step of h is one piece: at most 0.8 GB with the default architecture */
    TILE = 320,            /* the surroundings add a fifth to its work */
    TILE_MASK = 128,       /* small enough to fit what they follow */
    TILE_EARLY = 256       /* tiles that end early: the surroundings of smaller ones cost more than ending saves */
};

struct lgd_model {
    nn_model *net;
    ag_tape *tape;
};

/* Copies st into error. Returns its code. */
static int report(lgd_error *error, const ts_status *st)
{
    if (error) {
        error->code = st->code;
        memcpy(error->message, st->message, sizeof error->message);
    }
    return st->code;
}

_Static_assert(sizeof((lgd_error *)0)->message == sizeof((ts_status *)0)->message, "messages are copied whole");

const char *lgd_version(void) { return LGD_VERSION; }

lgd_options lgd_options_default(void) { return (lgd_options){.iterations = -1, .orientations = LGD_ORIENTATIONS_USUAL, .tolerance = LGD_TOLERANCE_USUAL}; }

int lgd_trained_iterations(const lgd_model *model) { return model->net->arch.iterations; }

int lgd_most_photos(const lgd_model *model) { return model->net->arch.images; }

lgd_photo lgd_flash_photo(const float *image)
{
    const rd_view flash = rd_flash();
    lgd_photo p = {.image = image, .power = flash.power};
    memcpy(p.light, flash.light, sizeof p.light);
    memcpy(p.camera, flash.camera, sizeof p.camera);
    return p;
}

lgd_model *lgd_load(const char *weights, lgd_error *error)
{
    ts_status st = {0};
    lgd_model *model = NULL;
    if (!weights) ts_fail(&st, TS_INVALID, "lgd_load: no weights file is given");
    else if (!(model = calloc(1, sizeof *model))) ts_fail(&st, TS_NOMEM, "%s: out of memory", weights);
    else if ((model->net = nn_model_load(weights, &st)) && (model->tape = ag_tape_create(false, &st))) ag_freeze(model->tape, true);
    if (st.code) lgd_free(&model);
    report(error, &st);
    return model;
}

void lgd_free(lgd_model **model)
{
    if (!model || !*model) return;
    ag_tape_destroy(&(*model)->tape);
    nn_model_free(&(*model)->net);
    free(*model);
    *model = NULL;
}

/* What the unrolled loop reports to: the caller's function, and what finds the end of the automatic number of steps. */
typedef struct watch {
    const nn_input *in;
    const lgd_options *options;
    float *best; /* NULL, or R_t of the last step that paid */
    double best_rmse;
    int steps;   /* t of best */
} watch;

#define AUTO_LEAST 1e-3 /* of the RMSE: a step that lowers it by less is not worth its time */

static bool after_step(int step, const ag_value *maps, void *user)
{
    watch *w = user;
    const rd_grid g = w->in->grid;
    double squares = 0;
    for (int k = 0; k < w->in->given; k++) {
        double one;
        rd_flash_rmse(g, maps->t.data, maps->t.shape.c, &w->in->views[k], w->in->image.data + (size_t)k * (size_t)g.h * (size_t)g.w * 3, &one);
        squares += one * one / w->in->given;
    }
    const double rmse = sqrt(squares);
    if (w->best) {
        if (step > 0 && !(rmse < w->best_rmse * (1 - AUTO_LEAST))) return false;
        memcpy(w->best, maps->t.data, (size_t)ts_count(maps->t.shape) * sizeof *w->best);
        w->best_rmse = rmse;
        w->steps = step;
    }
    return !w->options->progress || w->options->progress(step, rmse, w->options->user) == 0;
}

static ts_code check_photo(const lgd_photo *p, int number, ts_status *st)
{
    if (!p->image) return ts_fail(st, TS_INVALID, "lgd_estimate: photograph %d has no image", number);
    bool fine = isfinite(p->power) && p->power > 0 && p->light[2] > 0 && p->camera[2] > 0;
    for (int i = 0; i < 3; i++) fine = fine && isfinite(p->light[i]) && isfinite(p->camera[i]);
    if (!fine) return ts_fail(st, TS_INVALID, "lgd_estimate: light and camera of photograph %d must be above the sample, its power above 0", number);
    return TS_OK;
}

static ts_code check_arguments(const lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *o, const float *maps, ts_status *st)
{
    if (!model || !photo || !maps) return ts_fail(st, TS_INVALID, "lgd_estimate: model, image and maps must be given");
    if (photos < 1 || photos > model->net->arch.images)
        return ts_fail(st, TS_INVALID, "lgd_estimate: %d photographs: these weights read 1 .. %d", photos, model->net->arch.images);
    for (int k = 0; k < photos; k++)
        if (check_photo(&photo[k], k + 1, st) != TS_OK) return st->code;
    if (side < 1 || side > SIDE_MAX) return ts_fail(st, TS_INVALID, "lgd_estimate: side is %d and must lie in 1 .. %d", side, SIDE_MAX);
    if (o->iterations < LGD_AUTO || o->iterations > ITERATIONS_MAX)
        return ts_fail(st, TS_INVALID, "lgd_estimate: iterations is %d and must lie in 0 .. %d, or be -1 for as trained or %d for automatic", o->iterations,
                       ITERATIONS_MAX, LGD_AUTO);
    if (o->threads < 0 || o->threads > THREADS_MAX)
        return ts_fail(st, TS_INVALID, "lgd_estimate: threads is %d and must lie in 1 .. %d, or be 0 for all", o->threads, THREADS_MAX);
    if (!(o->tolerance >= 0 && o->tolerance <= 1) && o->tolerance != LGD_TOLERANCE_USUAL)
        return ts_fail(st, TS_INVALID, "lgd_estimate: tolerance is %g and must lie in 0 .. 1, or be %g for the usual one", o->tolerance, LGD_TOLERANCE_USUAL);
    if (o->precision != LGD_F32 && o->precision != LGD_BF16)
        return ts_fail(st, TS_INVALID, "lgd_estimate: precision is %d and must be %d for f32 or %d for bf16", o->precision, LGD_F32, LGD_BF16);
    if (o->orientations != 0 && o->orientations != 1 && o->orientations != 2 && o->orientations != 4 && o->orientations != 8)
        return ts_fail(st, TS_INVALID, "lgd_estimate: orientations is %d and must be 1, 2, 4 or 8", o->orientations);
    if ((o->tolerance > 0 || o->mask) && !lgd_tiles_exact(&model->net->arch))
        return ts_fail(st, TS_UNSUPPORTED, "lgd_estimate: these weights' loss is taken anew over the whole photograph at every step: no mask and no tolerance");
    if (o->iterations > 0 && !nn_arch_refines(&model->net->arch))
        return ts_fail(st, TS_UNSUPPORTED, "lgd_estimate: these weights have no refiner: only 0 iterations are possible");
    return TS_OK;
}

/* The network's encoding to the header's values. False when one is not finite. */
static bool decode(const float *from, int channels, int64_t pixels, float *maps)
{
    bool finite = true;
#pragma omp parallel for num_threads(ts_threads()) schedule(static) reduction(&& : finite)
    for (int64_t i = 0; i < pixels; i++) {
        const float *x = from + i * channels;
        float *m = maps + i * MAP_CHANNELS;
        for (int c = 0; c < MAP_CHANNELS; c++) finite = finite && isfinite(x[c]);
        const io_texel t = io_texel_get(x);
        memcpy(m + MAP_DIFFUSE, t.diffuse, sizeof t.diffuse);
        m[MAP_NORMAL] = t.normal[0];
        m[MAP_NORMAL + 1] = t.normal[1];
        m[MAP_ROUGHNESS] = t.roughness;
        memcpy(m + MAP_SPECULAR, t.specular, sizeof t.specular);
    }
    return finite;
}

void lgd_encode(const float *maps, int side, float *encoded)
{
    const int64_t pixels = (int64_t)side * side;
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
    for (int64_t i = 0; i < pixels; i++) {
        const float *m = maps + i * MAP_CHANNELS;
        const float x = m[MAP_NORMAL], y = m[MAP_NORMAL + 1];
        io_texel t = {.normal = {x, y, sqrtf(fmaxf(1 - x * x - y * y, 0))}, .roughness = m[MAP_ROUGHNESS]};
        memcpy(t.diffuse, m + MAP_DIFFUSE, sizeof t.diffuse);
        memcpy(t.specular, m + MAP_SPECULAR, sizeof t.specular);
        io_texel_put(encoded + i * MAP_CHANNELS, &t);
    }
}

/* What a step of h holds at once: maps, their gradient and change, the carried states, and for each of its two cells the convolution,
 * both gates' inputs and the new state. g works at its own size and needs less. */
static double step_bytes(const nn_arch *a, int side)
{
    const double cells = a->h_width > 0 ? 2.0 * (a->h_width + 8.0 * a->h_gru) : 0; /* the coarse steps' are at a size of their own */
    return (3.0 * a->images + (3.0 + 2.0 * a->images) * a->channels + cells) * sizeof(float) * side * side;
}

static ts_code not_finite(ts_status *st)
{
    return ts_fail(st, TS_NUMERIC, "the network's maps are not finite: the weights are damaged or did not train");
}

/* What is estimated from; proposed: R_0 where it is known, as in nn_input. */
typedef struct given_photos {
    const float *const *image;
    const rd_view *views;
    int count, side;
    const float *proposed;
} given_photos;

/* taken: NULL, or gets the number of steps that were made. */
static ts_code run_whole(lgd_model *model, const given_photos *p, int steps, const lgd_options *o, float *maps, int *taken, ts_status *st)
{
    const int side = p->side, given = p->count;
    ag_reset(model->tape);
    const double more = step_bytes(&model->net->arch, side) - (double)ts_arena_peak(ag_arena(model->tape)); /* than earlier calls left */
    if (more > 0 && lgd_memory_check(more, st) != TS_OK) return ts_context(st, "%d x %d pixels", side, side);
    nn_input in = {.image = ts_new(ag_arena(model->tape), (ts_shape){given, side, side, 3}), .grid = rd_grid_full(side), .views = p->views, .given = given, .orientations = o->orientations, .proposed = p->proposed};
    if (!in.image.data) return ts_fail(st, TS_NOMEM, "out of memory for an image of %d x %d pixels", side, side);
    const int64_t values = (int64_t)side * side * 3;
    for (int k = 0; k < given; k++)
        lgd_clip(values, p->image[k], in.image.data + k * values);

    watch w = {.in = &in, .options = o, .steps = steps};
    ag_value *out = NULL;
    if (o->iterations == LGD_AUTO) {
        w.best = ts_arena_alloc(ag_arena(model->tape), (size_t)side * (size_t)side * (size_t)model->net->arch.channels * sizeof *w.best);
        if (!w.best) return ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
    }
    if (nn_lgd(model->tape, model->net, &in, steps, false, &out, o->progress || w.best ? after_step : NULL, &w) != TS_OK || !out) {
        *st = *ag_status(model->tape);
        return st->code ? st->code : ts_fail(st, TS_NUMERIC, "the network gave no result");
    }
    if (taken) *taken = w.steps;
    return decode(w.best ? w.best : out->t.data, out->t.shape.c, (int64_t)side * side, maps) ? TS_OK : not_finite(st);
}

static ts_code estimate_whole(lgd_model *model, const given_photos *p, int steps, const lgd_options *o, float *maps, ts_status *st)
{
    return run_whole(model, p, steps, o, maps, NULL, st);
}

/* The number of steps that the photographs take at AUTO_SIDE pixels. */
static ts_code count_steps(lgd_model *model, const given_photos *p, int most, int orientations, int *steps, ts_status *st)
{
    enum { AUTO_SIDE = 256 };
    const int side = p->side, given = p->count, small = side < AUTO_SIDE ? side : AUTO_SIDE;
    const size_t pixels = (size_t)small * (size_t)small;
    const lgd_options o = {.iterations = LGD_AUTO, .orientations = orientations};
    float *photo = malloc((size_t)given * pixels * 3 * sizeof *photo), *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
    const float *each[NN_MAX_IMAGES];
    ts_arena *arena = ts_arena_create(0, st);
    ts_code code = photo && maps && arena ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    for (int k = 0; k < given && !code; k++) {
        ts_tensor to = ts_view(photo + (size_t)k * pixels * 3, (ts_shape){1, small, small, 3});
        const ts_tensor from = ts_view((float *)(uintptr_t)p->image[k], (ts_shape){1, side, side, 3});
        if (small == side) memcpy(to.data, p->image[k], pixels * 3 * sizeof *photo);
        else code = ts_resize(&to, &from, arena, st);
        each[k] = to.data;
    }
    if (!code) code = run_whole(model, &(given_photos){each, p->views, given, small, NULL}, most, &o, maps, steps, st);
    ts_arena_destroy(&arena);
    free(photo);
    free(maps);
    return code;
}

/* The caller's function, as tiles call it. */
typedef struct tile_watch {
    const lgd_options *options;
    double tiles, begun;
} tile_watch;

static int before_tile(void *user)
{
    tile_watch *w = user;
    return w->options->tile ? w->options->tile(w->begun++ / w->tiles, w->options->user) : 0;
}

static ts_code estimate_tiles(lgd_model *model, const given_photos *p, int steps, const lgd_options *o, float *maps, ts_status *st)
{
    const int side = p->side;
    const nn_arch *arch = &model->net->arch;
    const int64_t pixels = (int64_t)side * side;
    const int early = side > UNTILED ? TILE_EARLY : side, tile = o->mask ? TILE_MASK : o->tolerance > 0 ? early : TILE, across = (side + tile - 1) / tile;
    tile_watch w = {o, (double)across * across, 0};
    /* the network's channels are the caller's, but for published models */
    float *raw = arch->channels == MAP_CHANNELS ? maps : malloc((size_t)pixels * (size_t)arch->channels * sizeof *raw);
    double *rmse = calloc((size_t)steps + 1, sizeof *rmse);
    ts_code code = raw && rmse ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
    lgd_tiles t = {.image = p->image, .views = p->views, .given = p->count, .proposed = p->proposed, .mask = o->mask, .side = side, .tile = tile, .steps = steps, .orientations = o->orientations, .tolerance = o->tolerance, .rmse = o->progress ? rmse : NULL,
                   .alive = before_tile, .user = &w};
    if (!code) code = lgd_tiles_run(model->tape, model->net, &t, raw, st);
    int stop = steps;
    for (int i = 0; !code && o->progress && i < stop; i++)
        if (o->progress(i, rmse[i], o->user)) stop = i;
    if (!code && stop == steps && o->progress) o->progress(steps, rmse[steps], o->user);
    if (!code && stop < steps) {
        t.steps = stop;
        code = lgd_tiles_run(model->tape, model->net, &t, raw, st);
    }
    if (!code && !decode(raw, arch->channels, pixels, maps)) code = not_finite(st);
    if (raw != maps) free(raw);
    free(rmse);
    return code;
}

static ts_code estimate(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *o, float *maps, ts_status *st)
{
    const float *image[NN_MAX_IMAGES];
    rd_view views[NN_MAX_IMAGES];
    rd_view given[NN_MAX_IMAGES];
    int order[NN_MAX_IMAGES];
    for (int k = 0; k < photos; k++) {
        given[k] = (rd_view){.kind = RD_POINT, .power = photo[k].power};
        memcpy(given[k].light, photo[k].light, sizeof given[k].light);
        memcpy(given[k].camera, photo[k].camera, sizeof given[k].camera);
    }
    rd_capture_order(given, photos, order);
    for (int k = 0; k < photos; k++) {
        image[k] = photo[order[k]].image;
        views[k] = given[order[k]];
    }
    const bool tiles = lgd_tiles_exact(&model->net->arch) && (side > UNTILED || o->mask || o->tolerance > 0);
    if (o->power) *o->power = 1;
    given_photos p = {image, views, photos, side, NULL};
    float *proposed = NULL;
    ts_code code = TS_OK;
    if (o->power && model->net->arch.compat == NN_COMPAT_NONE) {
        const size_t size = (size_t)model->net->arch.g_size;
        proposed = malloc(size * size * (size_t)model->net->arch.channels * sizeof *proposed);
        if (!proposed) return ts_fail(st, TS_NOMEM, "out of memory");
        code = lgd_fit_power(model->tape, model->net, image, views, photos, side, o->orientations, proposed, o->power, st);
        for (int k = 0; k < photos; k++) views[k].power *= (float)*o->power;
        p.proposed = proposed;
    }
    int steps = o->iterations == -1 ? lgd_trained_iterations(model) : o->iterations;
    if (o->iterations == LGD_AUTO) {
        steps = nn_arch_refines(&model->net->arch) ? LGD_AUTO_MOST : 0;
        if (!code && tiles) code = count_steps(model, &p, steps, o->orientations, &steps, st);
    }
    if (!code) code = (tiles ? estimate_tiles : estimate_whole)(model, &p, steps, o, maps, st);
    free(proposed);
    return code;
}

int lgd_estimate_photos(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *options, float *maps, lgd_error *error)
{
    ts_status st = {0};
    lgd_options o = options ? *options : lgd_options_default();
    if (check_arguments(model, photo, photos, side, &o, maps, &st) == TS_OK) {
        if (o.tolerance == LGD_TOLERANCE_USUAL)
            o.tolerance = o.iterations == -1 && !o.exact && model->net->arch.h_width > 0 && lgd_tiles_exact(&model->net->arch) ? LGD_TOLERANCE : 0;
        const bool was = ts_conv_exact();
        const ts_precision before = ts_conv_precision();
        ts_threads_set(o.threads);
        ts_conv_exact_set(o.exact || model->net->arch.compat == NN_COMPAT_PUBLISHED); /* whoever runs that wants its numbers */
        ts_conv_precision_set(o.precision == LGD_BF16 ? TS_BF16 : TS_F32);
        estimate(model, photo, photos, side, &o, maps, &st);
        ts_conv_precision_set(before);
        ts_conv_exact_set(was);
    }
    return report(error, &st);
}

int lgd_estimate(lgd_model *model, const float *image, int side, const lgd_options *options, float *maps, lgd_error *error)
{
    const lgd_photo photo = lgd_flash_photo(image);
    return lgd_estimate_photos(model, &photo, 1, side, options, maps, error);
}

int lgd_render(const float *maps, int side, const float light[3], const float camera[3], float power, float *image, lgd_error *error)
{
    ts_status st = {0};
    rd_view view = {.kind = RD_POINT, .power = power};
    bool finite = isfinite(power);
    if (!maps || !light || !camera || !image) {
        ts_fail(&st, TS_INVALID, "lgd_render: maps, light, camera and image must be given");
        return report(error, &st);
    }
    for (int i = 0; i < 3; i++) {
        view.light[i] = light[i];
        view.camera[i] = camera[i];
        finite = finite && isfinite(light[i]) && isfinite(camera[i]);
    }
    if (!finite || power < 0) ts_fail(&st, TS_INVALID, "lgd_render: light, camera and power must be finite and power not negative");
    else if (side < 1 || side > SIDE_MAX) ts_fail(&st, TS_INVALID, "lgd_render: side is %d and must lie in 1 .. %d", side, SIDE_MAX);
    if (st.code) return report(error, &st);

    const size_t pixels = (size_t)side * (size_t)side;
    float *encoded = malloc(pixels * MAP_CHANNELS * sizeof *encoded);
    if (!encoded) {
        ts_fail(&st, TS_NOMEM, "lgd_render: out of memory for %d x %d pixels", side, side);
        return report(error, &st);
    }
    lgd_encode(maps, side, encoded);
    rd_render(rd_grid_full(side), encoded, MAP_CHANNELS, &view, false, image);
    free(encoded);
    return report(error, &st);
}
