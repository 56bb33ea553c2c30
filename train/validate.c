/* Validation: the errors of R_0 … R_T on procedural materials that training never sees. */
#include "render/error.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include "train/trainer_internal.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TOGETHER = 8 }; /* images that go through the network at once */

static bool make_materials(const tr_config *c, float *maps)
{
    const io_procedural source = {.seed = (uint64_t)c->validate.seed, .families = c->data.families};
    const int size = c->validate.size;
    const size_t values = (size_t)size * (size_t)size * MAP_CHANNELS;
    bool fine = true;
#pragma omp parallel for num_threads(ts_threads()) schedule(dynamic, 1) reduction(&& : fine)
    for (int i = 0; i < c->validate.count; i++) {
        io_material m;
        ts_status st = {0};
        if (io_material_create(&m, size, &st) != TS_OK) {
            fine = false;
            continue;
        }
        io_procedural_make(&source, (uint64_t)i, &m);
        memcpy(maps + (size_t)i * values, m.maps, values * sizeof(float));
        io_material_free(&m);
    }
    return fine;
}

ts_code tr_validator_create(tr_trainer *t, ts_status *st)
{
    const tr_config *c = &t->config;
    tr_validator *v = &t->validator;
    const size_t count = (size_t)c->validate.count, pixels = (size_t)c->validate.size * (size_t)c->validate.size;
    v->maps = malloc(count * pixels * MAP_CHANNELS * sizeof(float));
    const size_t given = (size_t)c->arch.images;
    v->images = malloc(count * given * pixels * 3 * sizeof(float));
    v->captures = malloc(count * given * sizeof *v->captures);
    v->shots = malloc(count * given * sizeof *v->shots);
    v->views = malloc(count * RD_EVAL_VIEWS * sizeof *v->views);
    if (!v->maps || !v->images || !v->captures || !v->shots || !v->views || !make_materials(c, v->maps))
        return ts_fail(st, TS_NOMEM, "no memory for the validation materials");
    v->model = tr_model_create(c, st);
    v->tape = v->model ? ag_tape_create(false, st) : NULL;
    if (!v->tape) return st->code;
    tr_capture_views((uint64_t)c->validate.seed, 0, c->validate.count, c->arch.images, v->captures);
    tr_config camera = *c;
    if (c->validate.camera == TR_CAMERA_DEFAULT) camera.data = tr_config_default().data;
    tr_photographs(&camera, (uint64_t)c->validate.seed, 0, c->validate.count, c->validate.size, v->maps, v->captures,
                   c->arch.images, v->images, v->shots);
    for (int i = 0; i < c->validate.count; i++) {
        ts_rng rng = ts_rng_make((uint64_t)c->validate.seed, TS_STREAM_EVAL, (uint64_t)i);
        rd_eval_views(&rng, RD_EVAL_VIEWS, v->views + (size_t)i * RD_EVAL_VIEWS);
    }
    return TS_OK;
}

void tr_validator_free(tr_validator *v)
{
    free(v->maps);
    free(v->images);
    free(v->captures);
    free(v->shots);
    free(v->views);
    nn_model_free(&v->model);
    ag_tape_destroy(&v->tape);
    *v = (tr_validator){0};
}

/* Of a photograph that comes from anywhere. */
static const unsigned char nothing[TOGETHER * NN_MAX_IMAGES];

/* Adds the errors of n materials from number first on to out. */
static ts_code add_errors(tr_trainer *t, int first, int n, tr_validation *out, ts_status *st)
{
    const tr_validator *v = &t->validator;
    const int size = t->config.validate.size, channels = t->config.arch.channels;
    const size_t pixels = (size_t)size * (size_t)size;
    const rd_grid grid = rd_grid_full(size);
    const size_t given = (size_t)t->config.arch.images, photograph = (size_t)first * given;
    const nn_input in = {
        .image = ts_view(v->images + photograph * pixels * 3, (ts_shape){n * (int)given, size, size, 3}),
        .grid = grid,
        .views = v->captures + photograph,
        .known = t->config.arch.conditions ? nothing : NULL,
        .given = (int)given};
    ag_value *maps[TR_MOST_ITERATIONS + 1];
    ag_reset(v->tape);
    if (v->model->coder.code > 0) { /* how well the maps themselves come back */
        float *truth = v->maps + (size_t)first * pixels * MAP_CHANNELS;
        maps[0] = nn_decode(v->tape, v->model,
                            nn_encode(v->tape, v->model,
                                      ag_constant(v->tape, ts_view(truth, (ts_shape){n, size, size, MAP_CHANNELS}))));
    } else nn_lgd(v->tape, v->model, &in, out->iterations, true, maps, NULL);
    if (ag_status(v->tape)->code != TS_OK) {
        *st = *ag_status(v->tape);
        return st->code;
    }
    for (int i = 0; i < n; i++) {
        const float *target = v->maps + (size_t)(first + i) * pixels * MAP_CHANNELS;
        const size_t at = (size_t)i * pixels * (size_t)channels;
        for (int k = 0; k <= out->iterations; k++) {
            const double rmse = rd_render_rmse(grid, maps[k]->t.data + at, channels, target, MAP_CHANNELS,
                                               v->views + (size_t)(first + i) * RD_EVAL_VIEWS, RD_EVAL_VIEWS);
            if (rmse < 0) return ts_fail(st, TS_NOMEM, "no memory for renderings of %d x %d pixels", size, size);
            out->render[k] += rmse;
        }
        const rd_map_error e = rd_map_rmse((int64_t)pixels, maps[out->iterations]->t.data + at, channels, target,
                                           MAP_CHANNELS);
        out->diffuse += e.diffuse;
        out->specular += e.specular;
        out->roughness += e.roughness;
        out->normal += e.normal;
    }
    return TS_OK;
}

ts_code tr_validate(tr_trainer *t, tr_validation *out, ts_status *st)
{
    const tr_config *c = &t->config;
    const int count = c->validate.count;
    /* Where an RMSE over the batch scales the gradient, a material's result must not depend on its neighbours. */
    const int together = c->arch.rmse == NN_RMSE_BATCH ? 1 : TOGETHER;
    const double start = tr_seconds();
    /* A step of the first phase has been made last: there is no refiner to speak of. */
    *out = (tr_validation){.step = t->step, .iterations = tr_pretraining(c, t->step - 1) ? 0 : c->arch.iterations};
    memcpy(t->validator.model->value, tr_weights(t), t->model->count * sizeof(float));
    for (int i = 0; i < count; i += together) {
        const ts_code code = add_errors(t, i, count - i < together ? count - i : together, out, st);
        if (code != TS_OK) return ts_context(st, "validation");
    }
    for (int k = 0; k <= out->iterations; k++) out->render[k] /= count;
    out->diffuse /= count;
    out->specular /= count;
    out->roughness /= count;
    out->normal /= count;
    const double error = out->render[out->iterations];
    out->best = error < t->best;
    if (out->best) {
        t->best = error;
        t->best_step = t->step;
    }
    out->seconds = tr_seconds() - start;
    return out->best ? tr_save_weights(t, "best.safetensors", st) : TS_OK;
}
