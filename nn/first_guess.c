#include "nn/first_guess.h"
#include "autograd/log_scale.h"
#include "nn/clip.h"
#include "nn/deviation.h"
#include "nn/facing.h"
#include "nn/hidden.h"
#include "nn/kind.h"
#include "nn/lattice.h"
#include "nn/lean.h"
#include "nn/likely_views.h"
#include "nn/relief.h"
#include "render/scene_model.h"
#include "tensor/maps.h"
#include "tensor/memory.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <math.h>
#include <string.h>

/* Of the roughness' error, relative to the roughness, what the fit may explain by a level of the whole material. It is
 * less than is true, about 1: where the maps lack relief the fit leans to rougher materials, and where the field of
 * view is not known a narrower one looks like them. */
#define ROUGHNESS_LEVEL 0.15
#define ROUGHNESS_LEVEL_IN_KNOWN_VIEW 0.4

/* Tone curve, lens and other lights change a photograph that was not taken with care all over it, and alike in
 * neighbours: to the numbers of the whole it tells less than to a pixel's maps. */
#define LEFT_OUT_ALL_OVER 4

enum { ROWS = 16 }; /* that another thread is worth */

/* The numbers that are known have no error: the prior keeps them. */
static void scene_prior(const float *said, const rd_view *view, int known, rd_scene_prior *prior)
{
    float given[RD_SCENE_NUMBERS];
    rd_scene_numbers(view, 0, 0, given);
    for (int i = 0; i < RD_SCENE_NUMBERS; i++) {
        prior->mean[i] = said[i];
        prior->deviation[i] = NN_LAPLACE * expf(ag_log_scale_held(said[RD_SCENE_NUMBERS + i]));
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

/* Of some of R_0's rows: the roughness (twice its value), and how far it may be off. */
typedef struct level_job {
    const nn_first_guess *g;
    int64_t w;
    int channels;
    double (*sums)[2]; /* of each row */
} level_job;

static void level_of_rows(const void *job, int64_t begin, int64_t end)
{
    const level_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        double rough = 0, off = 0;
        for (int64_t i = y * j->w; i < (y + 1) * j->w; i++) {
            const float own = j->g->r0[i * j->channels + MAP_ROUGHNESS];
            rough += own > -1 ? (double)own + 1 : 0;
            off += (double)j->g->deviation[i * NN_SPREADS + GROUP_ROUGHNESS];
        }
        j->sums[y][0] = rough, j->sums[y][1] = off;
    }
}

static void level_prior(rd_grid grid, const nn_first_guess *g, int channels, int known, rd_scene_prior *prior)
{
    const double part = known & NN_KNOWN_CAMERA ? ROUGHNESS_LEVEL_IN_KNOWN_VIEW : ROUGHNESS_LEVEL;
    double rough = 0, off = 0, (*sums)[2] = ts_scratch(0, (size_t)grid.h * sizeof *sums);
    ts_for(grid.threads, grid.h, ROWS, level_of_rows, &(level_job){g, grid.w, channels, sums});
    for (int y = 0; y < grid.h; y++) rough += sums[y][0], off += sums[y][1];
    prior->mean[RD_SCENE_ROUGHNESS] = 0;
    prior->deviation[RD_SCENE_ROUGHNESS] = (float)(part * fmin(off / fmax(rough, 1e-6), 1));
}

typedef struct colours_job {
    const float *from;
    int channels;
    float *to;
} colours_job;

static void copy_colours(const void *job, int64_t begin, int64_t end)
{
    const colours_job *j = job;
    for (int64_t i = begin * j->channels; i < end * j->channels; i += j->channels)
        for (int k = 0; k < 3; k++) {
            j->to[i + MAP_DIFFUSE + k] = j->from[i + MAP_DIFFUSE + k];
            j->to[i + MAP_SPECULAR + k] = j->from[i + MAP_SPECULAR + k];
        }
}

static ts_prior of_the_whole(int known)
{
    ts_prior scale = nn_step_prior(known, 1);
    if (!(known & NN_KNOWN_POWER)) scale.model *= LEFT_OUT_ALL_OVER, scale.gain *= LEFT_OUT_ALL_OVER;
    return scale;
}

static rd_scene_how with_errors(ts_prior scale)
{
    return (rd_scene_how){.steps = 4, .every = 8, .correlated = 256, .scale = scale};
}

/* The scene that explains the photograph best with R_0 as it is now: what the maps' levels were found with says less of
 * it. */
static void find_scene(rd_grid grid, const float *image, int channels, int known, const rd_scene_prior *prior,
                       nn_first_guess *g)
{
    const rd_scene_how how = with_errors(nn_step_prior(known, 1));
    rd_scene_prior beside = *prior;
    float unknown[RD_SCENE_UNKNOWNS] = {0};
    beside.mean[RD_SCENE_ROUGHNESS] = beside.deviation[RD_SCENE_ROUGHNESS] = 0;
    memcpy(unknown, g->number, sizeof g->number);
    rd_scene_fit(grid, g->r0, channels, g->deviation, image, &beside, &how, unknown, NULL);
    memcpy(g->number, unknown, sizeof g->number);
}

/* Scene and level, found from R_0; R_0's diffuse where that scene's highlight hides it; both again. Then the scene
 * alone. */
static ts_code fit(rd_grid grid, const float *image, int channels, int known, const rd_scene_prior *prior,
                   ts_arena *arena, nn_first_guess *g, ts_status *st)
{
    const rd_scene_how how = with_errors(of_the_whole(known));
    const int threads = grid.threads;
    const int64_t pixels = (int64_t)grid.h * grid.w;
    float unknown[RD_SCENE_UNKNOWNS], *rough = ts_arena_alloc(arena, (size_t)pixels * (size_t)channels * sizeof *rough);
    if (!rough) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", grid.w, grid.h);
    memcpy(unknown, prior->mean, sizeof unknown);
    rd_scene_fit(grid, g->r0, channels, g->deviation, image, prior, &how, unknown, NULL);
    rd_scene_roughen(pixels, g->r0, channels, unknown[RD_SCENE_ROUGHNESS], threads, rough);
    const ts_code code = nn_fill_hidden(grid, image, unknown, channels, arena, rough, st);
    if (code) return code;
    ts_for(threads, pixels, (int64_t)ROWS * grid.w, copy_colours, &(colours_job){rough, channels, g->r0});
    rd_scene_fit(grid, g->r0, channels, g->deviation, image, prior, &how, unknown, NULL);
    memcpy(g->number, unknown, sizeof g->number);
    rd_scene_roughen(pixels, g->r0, channels, unknown[RD_SCENE_ROUGHNESS], threads, g->r0);
    if (!(known & NN_KNOWN_LIGHT)) nn_share_lean(pixels, channels, threads, g->number, g->r0);
    if (!(known & NN_KNOWN_POWER)) find_scene(grid, image, channels, known, prior, g);
    return TS_OK;
}

/* Where the light is known its height, which a scene does not have, is as given. */
static rd_view view_of(const float number[RD_SCENE_NUMBERS], const nn_taken *taken)
{
    rd_view view = rd_scene_view(number);
    if (taken->known & NN_KNOWN_LIGHT) {
        const float higher = taken->view.light[2] / view.light[2];
        memcpy(view.light, taken->view.light, sizeof view.light);
        view.power *= higher * higher;
    }
    return view;
}

ts_code nn_first_guess_settle(rd_grid grid, int channels, const float *image, const float *scene, const nn_taken *taken,
                              ts_arena *arena, nn_first_guess *g, ts_status *st)
{
    const int64_t pixels = (int64_t)grid.h * grid.w;
    rd_scene_prior prior;
    const float stops = nn_take_kind(taken->kind, taken->known & NN_KNOWN_POWER, pixels, channels, g->r0);
    const bool told = taken->photographs > 1 || (taken->known & NN_KNOWN_POWER);
    ts_code code = nn_weigh_relief(grid.side, channels, g->spread, !told, grid.threads, arena, g->r0, st);
    if (code) return code;
    nn_deviations(pixels, g->spread, (nn_belief){.photographs = taken->photographs}, grid.threads, g->deviation);
    nn_deviations_of_kind(taken->kind, pixels, g->deviation);
    scene_prior(scene, &taken->view, taken->known, &prior);
    prior.mean[RD_SCENE_EXPOSURE] += stops;
    level_prior(grid, g, channels, taken->known, &prior);
    const ts_mark mark = ts_arena_mark(arena);
    code = fit(grid, image, channels, taken->known, &prior, arena, g, st);
    ts_arena_release(arena, mark);
    if (taken->photographs <= 1) nn_deviations_of_found_scene(pixels, grid.threads, g->deviation);
    g->view = view_of(g->number, taken);
    if (code == TS_OK) nn_face_camera(grid, g->view.camera, channels, g->r0);
    return code;
}

/* g's guess of a photograph [1, S, S, 3], of which in says what is known. False after an error, which the tape has. */
static bool ask_g(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess)
{
    if (in->known[0] & NN_KNOWN_POWER) return nn_guess_in_likely_views(tape, model, in, guess);
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *darker = ag_empty(tape, in->image.shape);
    if (!darker) return false;
    for (int64_t i = 0; i < ts_count(darker->t.shape); i++) darker->t.data[i] = NN_READ_AT * in->image.data[i];
    nn_input dim = *in;
    dim.image = darker->t;
    if (!nn_guess_in_likely_views(tape, model, &dim, guess)) return false;
    guess->scene->t.data[RD_SCENE_EXPOSURE] -= log2f(NN_READ_AT);
    ag_value *keep[3] = {guess->maps, guess->spread, guess->scene};
    ag_scope_end(tape, mark, keep, 3);
    *guess = (nn_guess){keep[0], keep[1], keep[2]};
    return true;
}

ts_code nn_first_guess_make(ag_tape *tape, const nn_model *model, const nn_first_ask *ask, nn_first_guess *g,
                            ts_status *st)
{
    const int size = nn_arch_side(&model->arch), side = ask->side, threads = ag_compute(tape)->threads;
    *g = (nn_first_guess){0};
    const ag_value *small = ag_empty(tape, (ts_shape){1, size, size, 3});
    if (!small) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    if (nn_clip_to(&ask->image, side, &small->t, ag_arena(tape), threads, st)) return st->code;
    const unsigned char is_known = (unsigned char)ask->taken.known;
    const nn_input in = {.image = small->t,
                         .grid = rd_grid_full(size),
                         .views = &ask->taken.view,
                         .known = &is_known,
                         .given = 1,
                         .orientations = ask->orientations};
    nn_guess guess = {0};
    const bool made = ask_g(tape, model, &in, &guess);
    ag_value *deviation = ag_empty(tape, (ts_shape){1, size, size, NN_SPREADS});
    if (!made || !deviation) {
        *st = *ag_status(tape);
        return st->code;
    }
    g->r0 = guess.maps->t.data;
    g->spread = guess.spread->t.data;
    g->deviation = deviation->t.data;
    const int period = model->arch.g_unshuffle;
    if (period > 1 && nn_take_lattice(period, size, model->arch.channels, threads, ag_arena(tape), g->r0, st))
        return st->code;
    return nn_first_guess_settle(rd_grid_on(rd_grid_full(size), threads), model->arch.channels, small->t.data,
                                 guess.scene->t.data, &ask->taken, ag_arena(tape), g, st);
}

double nn_first_guess_bytes(const nn_arch *a)
{
    const double side = nn_arch_side(a);
    return side * side * (3 + a->channels + 2 * NN_SPREADS) * sizeof(float);
}
