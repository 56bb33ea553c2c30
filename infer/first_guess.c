#include "infer/first_guess.h"
#include "infer/clip.h"
#include "infer/hidden_diffuse.h"
#include "infer/lean.h"
#include "render/scene_model.h"
#include "tensor/maps.h"
#include "tensor/memory.h"
#include "tensor/resize.h"
#include "tensor/team.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PIXELS = 1 << 11 }; /* at a time, at least */

/* Of F0's error, the part that a pixel may change by itself. What is not a level of the whole material is .35 of it; of
 * that, highlights leave the more in F0 the more is believed, and renderings do not tell .35 from .2. Several
 * photographs tell the level too. */
#define F0_DETAIL 0.2f
/* The same of the roughness once its level is found: highlights that a photograph cannot explain otherwise leave disks
 * and dots in it. */
#define ROUGHNESS_DETAIL 0.5f
/* Of the roughness' error, relative to the roughness, what the fit may explain by a level of the whole material. It is
 * less than is true, about 1: where the maps lack relief the fit leans to rougher materials, and where the field of
 * view is not known a narrower one looks like them. */
#define ROUGHNESS_LEVEL 0.15
#define ROUGHNESS_LEVEL_IN_KNOWN_VIEW 0.4
/* By which the deviations are multiplied where several photographs follow. Much of R_0's error is one of the whole
 * material, and of that the mean absolute error of a pixel says too little. */
#define SEVERAL 1.5f
#define LAPLACE 1.41421356f /* a Laplace density's standard deviation over its mean absolute error */

typedef struct deviation_job {
    const float *spread;
    float *to, f0, all; /* by which F0's and all are multiplied */
} deviation_job;

static void deviations(const void *job, int64_t begin, int64_t end)
{
    const deviation_job *j = job;
    for (int64_t i = begin * NN_SPREADS; i < end * NN_SPREADS; i++)
        j->to[i] = (i % NN_SPREADS == GROUP_SPECULAR ? j->f0 : 1) * j->all * LAPLACE * NN_SPREAD_UNIT *
            expf(fminf(fmaxf(j->spread[i], -6), 4));
}

/* The numbers that are known have no error: the prior keeps them. */
static void scene_prior(const float *said, const rd_view *view, int known, rd_scene_prior *prior)
{
    float given[RD_SCENE_NUMBERS];
    rd_scene_numbers(view, 0, 0, given);
    for (int i = 0; i < RD_SCENE_NUMBERS; i++) {
        prior->mean[i] = said[i];
        prior->deviation[i] = LAPLACE * expf(fminf(fmaxf(said[RD_SCENE_NUMBERS + i], -6), 4));
    }
    const bool camera = known & NN_KNOWN_CAMERA, light = known & NN_KNOWN_LIGHT, power = known & NN_KNOWN_POWER;
    const bool fixed[RD_SCENE_NUMBERS] = {[RD_SCENE_DISTANCE] = camera,
                                          [RD_SCENE_CAMERA_X] = camera && light,
                                          [RD_SCENE_CAMERA_Y] = camera && light,
                                          [RD_SCENE_LIGHT_X] = light,
                                          [RD_SCENE_LIGHT_Y] = light,
                                          [RD_SCENE_EXPOSURE] = power};
    for (int i = 0; i < RD_SCENE_NUMBERS; i++) {
        if (!fixed[i]) continue;
        prior->mean[i] = given[i];
        prior->deviation[i] = 0;
    }
    prior->mean[RD_SCENE_AMBIENT] = fmaxf(prior->mean[RD_SCENE_AMBIENT], 0);
    prior->mean[RD_SCENE_TONE] = prior->deviation[RD_SCENE_TONE] = 0; /* the steps have no tone curve */
}

static void level_prior(const lgd_first_guess *g, size_t pixels, int channels, int known, rd_scene_prior *prior)
{
    const double part = known & NN_KNOWN_CAMERA ? ROUGHNESS_LEVEL_IN_KNOWN_VIEW : ROUGHNESS_LEVEL;
    double rough = 0, off = 0;
    for (size_t i = 0; i < pixels; i++) {
        rough += fmax((double)g->r0[i * (size_t)channels + MAP_ROUGHNESS], -1) + 1;
        off += (double)g->deviation[i * NN_SPREADS + GROUP_ROUGHNESS];
    }
    prior->mean[RD_SCENE_ROUGHNESS] = 0;
    prior->deviation[RD_SCENE_ROUGHNESS] = (float)(part * fmin(off / fmax(rough, 1e-6), 1));
}

/* Scene and level, found from R_0; R_0's diffuse where that scene's highlight hides it; both again. */
static ts_code fit(rd_grid grid, const float *image, int channels, int known, const rd_scene_prior *prior,
                   ts_arena *arena, lgd_first_guess *g, ts_status *st)
{
    const rd_scene_how how = {.steps = 4, .every = 8, .correlated = 256, .scale = nn_step_prior(known, 1)};
    const int64_t pixels = (int64_t)grid.h * grid.w;
    const size_t values = (size_t)pixels * (size_t)channels;
    float unknown[RD_SCENE_UNKNOWNS], *rough = ts_arena_alloc(arena, values * sizeof *rough);
    if (!rough) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", grid.w, grid.h);
    memcpy(unknown, prior->mean, sizeof unknown);
    rd_scene_fit(grid, g->r0, channels, g->deviation, image, prior, &how, unknown, NULL);
    rd_scene_roughen(pixels, g->r0, channels, unknown[RD_SCENE_ROUGHNESS], rough);
    const ts_code code = lgd_fill_hidden_diffuse(grid, image, unknown, channels, arena, rough, st);
    if (!code) {
        for (size_t i = 0; i < values; i += (size_t)channels)
            memcpy(g->r0 + i + MAP_DIFFUSE, rough + i + MAP_DIFFUSE, 3 * sizeof *rough);
        rd_scene_fit(grid, g->r0, channels, g->deviation, image, prior, &how, unknown, NULL);
        memcpy(g->number, unknown, sizeof g->number);
        rd_scene_roughen(pixels, g->r0, channels, unknown[RD_SCENE_ROUGHNESS], g->r0);
        if (!(known & NN_KNOWN_LIGHT)) lgd_share_lean(pixels, channels, g->number, g->r0);
    }
    return code;
}

static ts_code make(ag_tape *tape, const nn_model *model, const float *image, int side, const rd_view *view, int known,
                    bool several, int orientations, lgd_first_guess *g, ts_status *st)
{
    const int size = nn_arch_side(&model->arch), threads = ag_compute(tape)->threads;
    const size_t pixels = (size_t)size * (size_t)size, whole = (size_t)side * (size_t)side * 3;
    ag_value *small = ag_empty(tape, (ts_shape){1, size, size, 3});
    g->r0 = malloc(pixels * (size_t)model->arch.channels * sizeof *g->r0);
    g->deviation = malloc(pixels * NN_SPREADS * sizeof *g->deviation);
    ts_tensor full = ts_new(ag_arena(tape), (ts_shape){1, side, side, 3});
    if (!small || !g->r0 || !g->deviation || !full.data)
        return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", side, side);
    lgd_clip((int64_t)whole, image, full.data);
    if (side == size) memcpy(small->t.data, full.data, whole * sizeof(float));
    else if (ts_resize(&small->t, &full, ag_arena(tape), threads, st)) return st->code;
    const unsigned char is_known = (unsigned char)known;
    const nn_input in = {.image = small->t,
                         .grid = rd_grid_full(size),
                         .views = view,
                         .known = &is_known,
                         .given = 1,
                         .orientations = orientations};
    nn_guess guess;
    if (!nn_guess_from(tape, model, &in, &guess)) {
        *st = *ag_status(tape);
        return st->code;
    }
    ts_memory_copy(g->r0, guess.maps->t.data, pixels * (size_t)model->arch.channels * sizeof *g->r0, threads);
    ts_for(threads, (int64_t)pixels, PIXELS, deviations,
           &(deviation_job){guess.spread->t.data, g->deviation, several ? 1 : F0_DETAIL, several ? SEVERAL : 1});
    rd_scene_prior prior;
    scene_prior(guess.scene->t.data, view, known, &prior);
    level_prior(g, pixels, model->arch.channels, known, &prior);
    const ts_code code = fit(rd_grid_on(rd_grid_full(size), threads), small->t.data, model->arch.channels, known,
                             &prior, ag_arena(tape), g, st);
    for (size_t i = GROUP_ROUGHNESS; i < pixels * NN_SPREADS && !several; i += NN_SPREADS)
        g->deviation[i] *= ROUGHNESS_DETAIL;
    return code;
}

ts_code lgd_first_guess_make(ag_tape *tape, const nn_model *model, const float *image, int side, const rd_view *view,
                             int known, bool several, int orientations, lgd_first_guess *guess, ts_status *st)
{
    *guess = (lgd_first_guess){0};
    const ts_mark mark = ag_scope_begin(tape);
    const ts_code code = make(tape, model, image, side, view, known, several, orientations, guess, st);
    ag_scope_end(tape, mark, NULL, 0);
    if (code) lgd_first_guess_free(guess);
    return code;
}

void lgd_first_guess_free(lgd_first_guess *guess)
{
    free(guess->r0);
    free(guess->deviation);
    *guess = (lgd_first_guess){0};
}
