/* One training step: photographs from maps, the loss, its gradient, Adam. */
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include "train/state.h"
#include <math.h>
#include <string.h>

ag_value *tr_add_normal_errors(tr_trainer *t, ag_value *loss, ag_value *maps, ag_value *target)
{
    const float rmse = (float)t->config.train.normal_rmse, mse = (float)t->config.train.normal_mse;
    if (rmse > 0)
        loss = ag_add(t->tape, loss, ag_scale(t->tape, ag_rmse_loss(t->tape, maps, target, MAP_NORMAL, 2), rmse));
    if (mse > 0)
        loss = ag_add(t->tape, loss, ag_scale(t->tape, ag_mse_loss(t->tape, maps, target, MAP_NORMAL, 2), mse));
    return loss;
}

ag_value *tr_add_loss(tr_trainer *t, ag_value *sum, ag_value *maps, ag_value *target, double weight, double *render,
                      double *map)
{
    ag_tape *tape = t->tape;
    const double map_weight = t->config.train.map_weight;
    if (maps && maps->t.shape.c > MAP_CHANNELS)
        maps = ag_channels(tape, maps, 0, MAP_CHANNELS); /* a material has no light intensity */
    ag_value *loss = ag_render_loss(tape, maps, target, t->views, RD_LOSS_VIEWS);
    if (loss) *render = (double)loss->t.data[0];
    if (map_weight > 0) {
        const float normal = (float)t->config.train.normal_weight, f0 = (float)t->config.train.specular_weight;
        const float of[MAP_CHANNELS] = {1, 1, 1, normal, normal, 1, f0, f0, f0};
        ag_value *l1 = ag_map_loss(tape, maps, target, of);
        if (l1) *map = (double)l1->t.data[0];
        loss = ag_add(tape, loss, map_weight == 1 ? l1 : ag_scale(tape, l1, (float)map_weight));
    }
    loss = tr_add_normal_errors(t, loss, maps, target);
    if (weight != 1) loss = ag_scale(tape, loss, (float)weight);
    return sum ? ag_add(tape, sum, loss) : loss;
}

/* Adds weight * loss to sum. */
static ag_value *add_weighted(ag_tape *tape, ag_value *sum, ag_value *loss, double weight, double *value)
{
    if (loss) *value = (double)loss->t.data[0];
    return ag_add(tape, sum, ag_scale(tape, loss, (float)weight));
}

ag_value *tr_guess_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row)
{
    const tr_config *c = &t->config;
    ag_tape *tape = t->tape;
    const int size = c->data.patch;
    nn_guess guess;
    if (!nn_guess_from(tape, t->model, in, &guess)) return NULL;
    ag_value *maps = guess.maps, *spread = guess.spread;
    if (maps->t.shape.h != size) {
        maps = ag_resize_smooth(tape, maps, size, size);
        if (spread) spread = ag_resize_smooth(tape, spread, size, size);
    }
    ag_value *loss = tr_add_loss(t, NULL, maps, target, 1, &row->render_start, &row->map_start);
    if (spread && maps && c->train.spread_weight > 0)
        loss = add_weighted(tape, loss,
                            ag_laplace(tape, ag_constant(tape, maps->t), spread, target, nn_spread_of, NN_SPREAD_UNIT),
                            c->train.spread_weight, &row->spread);
    if (guess.scene && c->train.scene_weight > 0) {
        static const signed char own[RD_SCENE_NUMBERS] = {0, 1, 2, 3, 4, 5, 6, 7};
        ag_value *truth = ag_constant(tape, ts_view(t->scenes, (ts_shape){t->batch, 1, 1, RD_SCENE_NUMBERS}));
        ag_value *numbers = ag_channels(tape, guess.scene, 0, RD_SCENE_NUMBERS),
                 *scale = ag_channels(tape, guess.scene, RD_SCENE_NUMBERS, RD_SCENE_NUMBERS);
        loss = add_weighted(tape, loss, ag_laplace(tape, numbers, scale, truth, own, 1), c->train.scene_weight,
                            &row->scene);
    }
    return loss;
}

/* The refinement steps of this step. */
static int draw_iterations(const tr_config *c, int64_t step)
{
    const int lo = c->train.iterations_min ? c->train.iterations_min : c->arch.iterations;
    const int hi = c->train.iterations_max ? c->train.iterations_max : c->arch.iterations;
    if (!nn_arch_refines(&c->arch)) return 0;
    ts_rng rng = ts_rng_make((uint64_t)c->train.seed, TS_STREAM_TRAIN, (uint64_t)step);
    return lo + ts_rng_int(&rng, hi - lo + 1);
}

/* The photographs of each material in this step. */
static int draw_given(const tr_config *c, int64_t step)
{
    const int hi = tr_most_given(c), lo = c->train.given_min ? c->train.given_min : hi;
    ts_rng rng = ts_rng_make((uint64_t)c->train.seed, TS_STREAM_GIVEN, (uint64_t)step);
    return lo + ts_rng_int(&rng, hi - lo + 1);
}

/* The window of all photographs that h refines in this step. */
static rd_grid draw_window(const tr_config *c, int64_t step)
{
    const int size = c->data.patch, side = c->train.window ? c->train.window : size;
    ts_rng rng = ts_rng_make((uint64_t)c->train.seed, TS_STREAM_WINDOW, (uint64_t)step);
    const int y0 = ts_rng_int(&rng, size - side + 1), x0 = ts_rng_int(&rng, size - side + 1);
    return (rd_grid){.h = side, .w = side, .y0 = y0, .x0 = x0, .side = size};
}

/* The window's part of [N, S, S, C], contiguous, in the tape's arena. */
static ts_tensor cut(tr_trainer *t, const ts_tensor *whole, rd_grid g)
{
    ts_tensor part = ts_window(whole, g.y0, g.x0, g.h, g.w), copy = ts_new(ag_arena(t->tape), part.shape);
    if (copy.data) ts_copy(&copy, &part);
    else ag_fail(t->tape, TS_NOMEM, "no memory for a window of %d x %d pixels", g.w, g.h);
    return copy;
}

/* The camera as far from the centre, above it: where a field of view alone puts one that is tilted. */
static void stand_above(float camera[3])
{
    camera[2] = sqrtf(camera[0] * camera[0] + camera[1] * camera[1] + camera[2] * camera[2]);
    camera[0] = camera[1] = 0;
}

/* What g may read of each photograph, and what it is to guess. The place of a light is known where the camera's is, in
 * half of the photographs, in a measured step in all; a camera whose field of view alone is known stands above the
 * centre. What a student learns without its teacher, of camera and power, the teacher is not asked. */
static void describe(tr_trainer *t, int given)
{
    const bool measured = tr_measured(&t->config, t->step),
               taught = t->config.train.lesson == TR_LESSON_KNOWN && !measured;
    ts_rng rng = ts_rng_make((uint64_t)t->config.train.seed, TS_STREAM_KNOWN, (uint64_t)t->step);
    for (int i = 0; i < t->first * given; i++) ts_rng_uniform(&rng); /* other ranks' */
    for (int i = 0; i < t->batch * given; i++) {
        const tr_shot *s = &t->shots[i];
        const bool half = ts_rng_uniform(&rng) < 0.5f, light = (half || measured) && s->told_view,
                   power = s->told_power && !(taught && s->told_view);
        rd_scene_numbers(&s->is.view, s->is.ambient, s->is.tone, t->scenes + (size_t)i * RD_SCENE_NUMBERS);
        t->known[i] = (unsigned char)((s->told_view ? NN_KNOWN_CAMERA : 0) | (light ? NN_KNOWN_LIGHT : 0) |
                                      (power ? NN_KNOWN_POWER : 0));
        t->captures[i] = s->thought;
        if (s->told_view && !light) stand_above(t->captures[i].camera);
    }
}

static ag_value *forward(tr_trainer *t, const float *target, int given, tr_row *row)
{
    const tr_config *c = &t->config;
    const int batch = t->batch, size = c->data.patch;
    ag_value *maps[TR_MOST_ITERATIONS + 1];
    ts_tensor goals = ts_view((float *)(uintptr_t)target, (ts_shape){batch, size, size, MAP_CHANNELS});
    nn_input in = {.image = ts_view(t->images, (ts_shape){batch * given, size, size, 3}),
                   .grid = rd_grid_full(size),
                   .views = t->captures,
                   .known = c->arch.conditions || c->arch.revisions > 0 ? t->known : NULL,
                   .given = given,
                   .recompute = c->train.checkpoint_steps};
    if (row->pretraining) {
        const bool taught = t->teacher && !tr_measured(c, t->step);
        return (taught ? tr_taught_loss : tr_guess_loss)(t, &in, ag_constant(t->tape, goals), row);
    }
    if (c->arch.revisions > 0) return tr_revision_loss(t, &in, ag_constant(t->tape, goals), row);
    if (c->coder.code > 0) {
        ag_value *goal = ag_constant(t->tape, goals);
        return tr_add_loss(t, NULL, nn_decode(t->tape, t->model, nn_encode(t->tape, t->model, goal)), goal, 1,
                           &row->render_end, &row->map_end);
    }
    const rd_grid window = draw_window(c, t->step);
    if (window.w < size) {
        in.whole = in.image;
        in.grid = window;
        in.image = cut(t, &in.whole, window);
        goals = cut(t, &goals, window);
        if (!in.image.data || !goals.data) return NULL;
    }
    ag_value *goal = ag_constant(t->tape, goals);
    row->iterations = draw_iterations(c, t->step);
    if (nn_lgd(t->tape, t->model, &in, row->iterations, true, maps, NULL) != TS_OK) return NULL;
    ag_value *loss = tr_add_loss(t, NULL, maps[row->iterations], goal, 1, &row->render_end, &row->map_end);
    if (row->iterations > 0 && c->train.start_weight > 0)
        loss = tr_add_loss(t, loss, maps[0], goal, c->train.start_weight, &row->render_start, &row->map_start);
    return loss;
}

static double rate_now(const tr_config *c, int64_t step)
{
    const bool pre = tr_pretraining(c, step);
    const int64_t length = pre ? c->train.pretrain_steps : c->train.steps,
                  at = pre ? step : step - c->train.pretrain_steps;
    const int64_t warmup = c->train.warmup < length / 2 ? c->train.warmup : length / 2;
    return (double)nn_learning_rate((float)(pre ? c->train.pretrain_rate : c->train.rate),
                                    (float)(pre ? c->train.pretrain_floor : c->train.rate_floor), at, warmup, length);
}

/* The second phase has another loss: Adam restarts. A g that is fixed from now on is the one that is saved. */
static void begin_phase(tr_trainer *t)
{
    size_t first, last;
    if (t->step == 0 || t->step != t->config.train.pretrain_steps) return;
    memset(t->adam.m, 0, t->adam.count * sizeof(float));
    memset(t->adam.v, 0, t->adam.count * sizeof(float));
    t->adam.step = 0;
    t->best = INFINITY; /* R_0's error before, R_T's from now on */
    if (t->config.train.g_rate > 0 || !t->adam.ema) return;
    nn_model_range(t->model, NN_G, &first, &last);
    memcpy(t->model->value + first, t->adam.ema + first, (last - first) * sizeof(float));
}

#define NORM_DECAY 0.98

/* A gradient of 0 comes from saturated outputs, which do not recover. One far above the recent norm, even clipped,
 * moves every weight with a small second moment by a whole step, and can end a run. */
static const char *why_skip(const tr_trainer *t, const tr_row *row)
{
    enum { SETTLED = 100 }; /* steps before which norms change fast for good reasons */
    const double spike = t->config.train.spike;
    if (!isfinite(row->loss)) return "loss is not finite";
    if (!isfinite(row->norm)) return "gradient is not finite";
    if (row->norm == 0) return "gradient is zero";
    if (spike > 0 && t->adam.step >= SETTLED && row->norm > spike * t->mean_norm)
        return "gradient is far longer than usual (train.spike)";
    return NULL;
}

/* By which the learning rate is multiplied for each part of the model. */
static void rate_factors(const tr_config *c, bool pretraining, double factor[NN_COARSE + 1])
{
    factor[NN_G] = pretraining ? 1 : c->train.g_rate;
    factor[NN_H] = !pretraining;
    factor[NN_COARSE] = pretraining ? 0 : c->train.coarse_rate;
}

/* Number i of the ranges of a part that are trained and of which this rank has the gradients' sums; false: there are no
 * more. */
static bool own_range(const tr_trainer *t, int part, int i, size_t *first, size_t *last)
{
    nn_model_range(t->model, (nn_part)part, first, last);
    return !t->model->fixed[part] && tr_reduce_own(&t->reducer, i, first, last);
}

/* Of what is trained. */
static double gradient_norm(tr_trainer *t, tr_row *row)
{
    double squares = 0;
    for (int part = NN_G; part <= NN_COARSE; part++) {
        size_t first, last;
        for (int i = 0; own_range(t, part, i, &first, &last); i++) {
            const double norm = first < last ? nn_gradient_norm(t->model, first, last) : 0;
            squares += norm * norm;
        }
    }
    if (t->reducer.parts) {
        const double start = tr_seconds();
        squares = t->ranks.mpi->sum_here(squares);
        row->waited += tr_seconds() - start;
    }
    return sqrt(squares);
}

/* The materials of this rank in this step, their photographs and the views of their loss: functions of each material's
 * number in the run, whatever the number of ranks. NULL and st on failure. */
static const float *draw(tr_trainer *t, int given, ts_status *st)
{
    const tr_config *c = &t->config;
    const float *target = io_loader_next(t->loader, st);
    if (!target) return ts_context(st, "procedural materials"), NULL;
    const uint64_t index = (uint64_t)t->step * (uint64_t)c->train.batch + (uint64_t)t->first;
    tr_capture_views(c->data.sheet, (uint64_t)c->data.seed, index, t->batch, given, t->captures);
    tr_config measured;
    tr_photographs(tr_taken_with(c, t->step, &measured), (uint64_t)c->data.seed, index, t->batch, c->data.patch, target,
                   t->captures, given, t->images, t->shots);
    if (c->arch.revisions > 0 && given > 1) tr_describe_several(t->shots, t->batch * given, t->captures, t->known);
    else if (c->arch.conditions || c->arch.scene) describe(t, given);
    ts_rng rng = ts_rng_make((uint64_t)c->train.seed, TS_STREAM_SCENE, (uint64_t)t->step);
    for (int i = -t->first; i < t->batch; i++) { /* other ranks' are drawn over */
        rd_view *views = t->views + (i < 0 ? 0 : i) * RD_LOSS_VIEWS;
        rd_loss_views(&rng, views);
        rd_flash_views(&rng, c->train.flash_views, views + RD_LOSS_VIEWS - c->train.flash_views);
    }
    return target;
}

/* The sums outlive a step that fails before they end. */
static ts_code begin_losses(tr_trainer *t, const tr_row *row, double weight, ts_status *st)
{
    tr_losses *l = &t->losses;
    *l = (tr_losses){.loss = weight * row->loss,
                     .render_start = weight * row->render_start,
                     .map_start = weight * row->map_start,
                     .render_end = weight * row->render_end,
                     .map_end = weight * row->map_end,
                     .spread = weight * row->spread,
                     .scene = weight * row->scene,
                     .stop = t->listener.stop && t->listener.stop(t->listener.user)};
    tr_reduce_begin(&t->reducer);
    t->posted = true;
    return t->ranks.mpi->begin_sum(&l->loss, sizeof *l / sizeof l->loss, st);
}

/* Waits for the gradients and losses of all ranks. One whose loss is not finite has begun the same sums. */
static ts_code end_losses(tr_trainer *t, tr_row *row, ts_status *st)
{
    const tr_losses *l = &t->losses;
    const double start = tr_seconds();
    if (tr_reduce_finish(&t->reducer, st) != TS_OK) return st->code;
    t->posted = false;
    row->waited = tr_seconds() - start;
    row->loss = l->loss;
    row->render_start = l->render_start, row->map_start = l->map_start;
    row->render_end = l->render_end, row->map_end = l->map_end;
    row->spread = l->spread, row->scene = l->scene;
    t->stop = l->stop > 0;
    return TS_OK;
}

/* The loss, and its gradient in the model's block, of all ranks. */
static ts_code differentiate(tr_trainer *t, const float *target, int given, tr_row *row, ts_status *st)
{
    const double weight = (double)t->batch / t->config.train.batch;
    ag_value *loss = forward(t, target, given, row);
    if (loss) row->loss = (double)loss->t.data[0];
    if (loss && t->ranks.mpi) {
        if (begin_losses(t, row, weight, st) != TS_OK) return st->code;
        loss = ag_scale(t->tape, loss, (float)weight);
    }
    if (loss && isfinite(row->loss)) ag_backward(t->tape, loss);
    if (ag_status(t->tape)->code) {
        *st = *ag_status(t->tape);
        return st->code;
    }
    if (t->ranks.mpi && end_losses(t, row, st) != TS_OK) return st->code;
    if (isfinite(row->loss)) row->norm = gradient_norm(t, row);
    return TS_OK;
}

/* Ranks that share memory go on when all of them have written what is theirs. */
static void meet(tr_trainer *t, tr_row *row)
{
    const double start = tr_seconds();
    if (!t->reducer.parts) return;
    t->ranks.mpi->meet();
    row->waited += tr_seconds() - start;
}

static void update(tr_trainer *t, tr_row *row, const double factor[NN_COARSE + 1])
{
    const double clip = t->config.train.clip;
    const float scale = clip > 0 && row->norm > clip ? (float)(clip / row->norm) : 1.0f;
    nn_adam_next(&t->adam);
    for (int part = NN_G; part <= NN_COARSE; part++) {
        size_t first, last;
        for (int i = 0; own_range(t, part, i, &first, &last); i++)
            if (first < last) nn_adam_step(&t->adam, t->model, first, last, (float)(row->rate * factor[part]), scale);
    }
    meet(t, row);
    t->mean_norm = t->adam.step == 1 ? row->norm : NORM_DECAY * t->mean_norm + (1 - NORM_DECAY) * row->norm;
}

ts_code tr_step(tr_trainer *t, tr_row *row, ts_status *st)
{
    const tr_config *c = &t->config;
    const double start = tr_seconds();
    *row = (tr_row){.total = tr_total(c),
                    .pretraining = tr_pretraining(c, t->step),
                    .batch = c->train.batch,
                    .loss = NAN,
                    .norm = NAN,
                    .render_start = NAN,
                    .map_start = NAN,
                    .spread = NAN,
                    .scene = NAN,
                    .render_end = NAN,
                    .map_end = NAN};
    begin_phase(t);
    const int given = draw_given(c, t->step);
    const float *target = draw(t, given, st);
    if (!target) return st->code;

    double factor[NN_COARSE + 1]; /* of the rate, for each part */
    rate_factors(c, row->pretraining, factor);
    for (int part = NN_G; part <= NN_COARSE; part++) t->model->fixed[part] = factor[part] == 0;
    row->g_fixed = t->model->fixed[NN_G];
    ag_reset(t->tape);
    ag_compute_set(t->tape, (ts_compute){.exact = c->train.exact, .precision = c->train.precision});
    if (differentiate(t, target, given, row, st) != TS_OK) return st->code;
    row->rate = rate_now(c, t->step);
    row->skip = why_skip(t, row);
    if (row->skip) {
        meet(t, row); /* the others may still read this rank's gradients */
        memset(t->model->grad, 0, t->model->count * sizeof(float));
        t->skipped++;
        t->in_a_row++;
    } else {
        update(t, row, factor);
        t->in_a_row = 0;
    }
    row->step = ++t->step;
    row->skipped_total = t->skipped;
    row->seconds = tr_seconds() - start;
    t->waited += row->waited;
    t->busy += row->seconds;
    return TS_OK;
}
