/* Validation: the errors of R_0 … R_T on procedural materials that training never sees. */
#include "render/error.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include "train/state.h"
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { TOGETHER = 8 }; /* images that go through the network at once */

typedef struct making {
    const tr_config *c;
    int first;
    float *maps;
    atomic_bool *fine;
} making;

static void make_material(const void *job, int64_t i)
{
    const making *j = job;
    const io_procedural source = {.seed = (uint64_t)j->c->validate.seed, .families = j->c->data.families};
    const int size = j->c->validate.size;
    const size_t values = (size_t)size * (size_t)size * MAP_CHANNELS;
    io_material m;
    ts_status st = {0};
    if (io_material_create(&m, size, &st) != TS_OK) {
        atomic_store(j->fine, false);
        return;
    }
    io_procedural_make(&source, (uint64_t)(j->first + i), &m);
    memcpy(j->maps + (size_t)i * values, m.maps, values * sizeof(float));
    io_material_free(&m);
}

static bool make_materials(const tr_config *c, int first, int count, float *maps)
{
    atomic_bool fine = true;
    ts_tasks(0, count, make_material, &(making){c, first, maps, &fine});
    return fine;
}

/* Whether the materials teach photographs alone whose light and camera are known: then such ones are validated. */
static bool learns_known(const tr_config *c)
{
    return c->arch.conditions && c->arch.images == 1 &&
        (c->train.lesson == TR_LESSON_KNOWN || c->data.measured == 1 ||
         (c->data.told_view == 1 && c->data.told_power == 1));
}

ts_code tr_validator_create(tr_trainer *t, ts_status *st)
{
    const tr_config *c = &t->config;
    tr_validator *v = &t->validator;
    v->count = tr_share(&t->ranks, c->validate.count, &v->first);
    /* of more ranks than materials some have none; a block of nothing is none */
    const size_t count = (size_t)(v->count > 0 ? v->count : 1),
                 pixels = (size_t)c->validate.size * (size_t)c->validate.size;
    v->maps = malloc(count * pixels * MAP_CHANNELS * sizeof(float));
    const size_t given = (size_t)tr_most_given(c);
    v->images = malloc(count * given * pixels * 3 * sizeof(float));
    v->captures = malloc(count * given * sizeof *v->captures);
    v->shots = malloc(count * given * sizeof *v->shots);
    v->known = malloc(count * given);
    v->views = malloc(count * RD_EVAL_VIEWS * sizeof *v->views);
    v->errors = malloc((size_t)c->validate.count * TR_ERRORS * sizeof *v->errors);
    if (!v->maps || !v->images || !v->captures || !v->shots || !v->known || !v->views || !v->errors ||
        !make_materials(c, v->first, v->count, v->maps))
        return ts_fail(st, TS_NOMEM, "no memory for the validation materials");
    v->model = tr_model_create(c, st);
    v->tape = v->model ? ag_tape_create(false, st) : NULL;
    if (!v->tape) return st->code;
    const uint64_t first = (uint64_t)v->first;
    tr_config camera = *c;
    if (c->validate.camera == TR_CAMERA_DEFAULT) camera.data = tr_config_default().data;
    const bool known = learns_known(c);
    if (known && (c->train.lesson == TR_LESSON_KNOWN || c->data.measured == 1)) camera = tr_measured_camera(&camera);
    tr_capture_views(camera.data.sheet, (uint64_t)c->validate.seed, first, v->count, (int)given, v->captures);
    tr_photographs(&camera, (uint64_t)c->validate.seed, first, v->count, c->validate.size, v->maps, v->captures,
                   (int)given, v->images, v->shots);
    if (known || (c->arch.revisions > 0 && given > 1))
        tr_describe_several(v->shots, v->count * (int)given, v->captures, v->known);
    for (int i = 0; i < v->count; i++) {
        ts_rng rng = ts_rng_make((uint64_t)c->validate.seed, TS_STREAM_EVAL, first + (uint64_t)i);
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
    free(v->known);
    free(v->views);
    free(v->errors);
    nn_model_free(&v->model);
    ag_tape_destroy(&v->tape);
    *v = (tr_validator){0};
}

/* Of a photograph that comes from anywhere. */
static const unsigned char nothing[TOGETHER * NN_MAX_IMAGES];

/* The first guess and its revisions. */
static void revise(ag_tape *tape, const nn_model *model, const nn_input *in, int revisions, ag_value **maps)
{
    nn_revision r;
    if (!tr_first_guesses(tape, model, in, NULL, &r)) return;
    for (int k = 0; k <= revisions; k++) {
        maps[k] = r.maps;
        if (k < revisions && !nn_revise(tape, model, &r)) return;
    }
}

/* Measures n materials from number first of the share on, of R_0 ... R_iterations. */
static ts_code measure(tr_trainer *t, int first, int n, int iterations, ts_status *st)
{
    const tr_validator *v = &t->validator;
    const int size = t->config.validate.size;
    const size_t pixels = (size_t)size * (size_t)size;
    const rd_grid grid = rd_grid_full(size);
    const size_t given = (size_t)tr_most_given(&t->config), photograph = (size_t)first * given;
    nn_input in = {.image = ts_view(v->images + photograph * pixels * 3, (ts_shape){n * (int)given, size, size, 3}),
                   .grid = grid,
                   .views = v->captures + photograph,
                   .known = t->config.arch.conditions ? nothing : NULL,
                   .given = (int)given};
    ag_value *maps[TR_MOST_ITERATIONS + 1];
    if (learns_known(&t->config) || (v->model->arch.revisions > 0 && given > 1)) in.known = v->known + photograph;
    ag_reset(v->tape);
    if (v->model->coder.code > 0) { /* how well the maps themselves come back */
        float *truth = v->maps + (size_t)first * pixels * MAP_CHANNELS;
        maps[0] = nn_decode(v->tape, v->model,
                            nn_encode(v->tape, v->model,
                                      ag_constant(v->tape, ts_view(truth, (ts_shape){n, size, size, MAP_CHANNELS}))));
    } else if (iterations > 0 && v->model->arch.revisions > 0) revise(v->tape, v->model, &in, iterations, maps);
    else nn_lgd(v->tape, v->model, &in, iterations, true, maps, NULL);
    if (ag_status(v->tape)->code != TS_OK) {
        *st = *ag_status(v->tape);
        return st->code;
    }
    const int channels = maps[0]->t.shape.c; /* an auto-encoder's are those of maps, whatever g says */
    for (int i = 0; i < n; i++) {
        const float *target = v->maps + (size_t)(first + i) * pixels * MAP_CHANNELS;
        const size_t at = (size_t)i * pixels * (size_t)channels;
        double *error = v->errors + (size_t)(v->first + first + i) * TR_ERRORS;
        for (int k = 0; k <= iterations; k++) {
            error[k] = rd_render_rmse(grid, maps[k]->t.data + at, channels, target, MAP_CHANNELS,
                                      v->views + (size_t)(first + i) * RD_EVAL_VIEWS, RD_EVAL_VIEWS);
            if (error[k] < 0) return ts_fail(st, TS_NOMEM, "no memory for renderings of %d x %d pixels", size, size);
        }
        const rd_map_error e = rd_map_rmse((int64_t)pixels, maps[iterations]->t.data + at, channels, target,
                                           MAP_CHANNELS);
        memcpy(error + TR_MOST_ITERATIONS + 1, (double[]){e.diffuse, e.specular, e.roughness, e.normal},
               4 * sizeof *error);
    }
    return TS_OK;
}

ts_code tr_validate(tr_trainer *t, tr_validation *out, ts_status *st)
{
    const tr_config *c = &t->config;
    tr_validator *v = &t->validator;
    const int count = c->validate.count;
    /* Where an RMSE over the batch scales the gradient, a material's result must not depend on its neighbours. */
    const int together = c->arch.rmse == NN_RMSE_BATCH ? 1 : TOGETHER;
    /* A step of the first phase has been made last: there is no refiner to speak of. */
    *out = (tr_validation){.step = t->step,
                           .iterations = tr_pretraining(c, t->step - 1) ? 0
                               : c->arch.revisions > 0                  ? c->arch.revisions
                                                                        : c->arch.iterations};
    memcpy(v->model->value, tr_weights(t), t->model->count * sizeof(float));
    memset(v->errors, 0, (size_t)count * TR_ERRORS * sizeof *v->errors);
    ts_code code = TS_OK;
    for (int i = 0; i < v->count && !code; i += together)
        code = measure(t, i, v->count - i < together ? v->count - i : together, out->iterations, st);
    if (code) ts_context(st, "validation");
    if (tr_agree(&t->ranks, code, st) != TS_OK) return st->code;
    /* The others' are zeros here: the sums are what one process has. */
    if (t->ranks.mpi) t->ranks.mpi->sum(v->errors, count * TR_ERRORS);
    for (int i = 0; i < count; i++) {
        const double *error = v->errors + (size_t)i * TR_ERRORS, *map = error + TR_MOST_ITERATIONS + 1;
        for (int k = 0; k <= out->iterations; k++) out->render[k] += error[k];
        out->diffuse += map[0];
        out->specular += map[1];
        out->roughness += map[2];
        out->normal += map[3];
    }
    for (int k = 0; k <= out->iterations; k++) out->render[k] /= count;
    out->diffuse /= count;
    out->specular /= count;
    out->roughness /= count;
    out->normal /= count;
    const double error = out->render[out->iterations];
    out->best = error < t->best;
    if (out->best) t->best = error;
    return tr_agree(&t->ranks, out->best ? tr_save_weights(t, "best.safetensors", st) : TS_OK, st);
}
