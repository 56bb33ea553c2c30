/* Training steps of the shipped configurations' shapes, what its data and its renderings cost beside it, and its memory
 * with and without train.checkpoint_steps. */
#include "bench/bench.h"
#include "bench/shape.h"
#include "data/materials/procedural.h"
#include "nn/adam.h"
#include "nn/model.h"
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "train/config.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct subject {
    tr_config c;
    nn_model *model;
    nn_adam adam;
    ag_tape *tape;
    nn_input in;
    float *maps, *images, *goal, *window;
    rd_view *views;
    int steps;
    uint64_t next;
} subject;

static ag_value *loss_of(subject *s, ag_value *maps)
{
    ag_value *goal = ag_constant(s->tape, ts_view(s->goal, maps->t.shape));
    return ag_add(s->tape, ag_render_loss(s->tape, maps, goal, s->views, RD_LOSS_VIEWS),
                  ag_map_loss(s->tape, maps, goal, NULL));
}

static void step(void *user)
{
    subject *s = user;
    ag_value *maps[65];
    ag_reset(s->tape);
    nn_lgd(s->tape, s->model, &s->in, s->steps, true, maps, NULL);
    if (ag_status(s->tape)->code) return;
    ag_value *loss = loss_of(s, maps[0]);
    ag_backward(s->tape, s->steps > 0 ? ag_add(s->tape, loss_of(s, maps[s->steps]), loss) : loss);
    nn_adam_next(&s->adam);
    for (int part = NN_G; part <= NN_COARSE; part++) {
        size_t first, last;
        nn_model_range(s->model, (nn_part)part, &first, &last);
        if (s->model->fixed[part] || first == last) continue;
        nn_gradient_norm(s->model, first, last);
        nn_adam_step(&s->adam, s->model, first, last, 1e-4f, 1);
    }
}

static void losses(void *user)
{
    subject *s = user;
    ag_reset(s->tape);
    const ts_shape shape = {s->c.train.batch, s->in.grid.h, s->in.grid.w, MAP_CHANNELS};
    float *gradient = ts_arena_zalloc(ag_arena(s->tape), (size_t)ts_count(shape), sizeof *gradient);
    for (int i = 0; i < (s->steps > 0 ? 2 : 1); i++)
        ag_backward(s->tape, loss_of(s, ag_parameter(s->tape, ts_view(s->window, shape), gradient)));
}

static void material(void *user)
{
    subject *s = user;
    io_material m = {.size = s->c.data.patch, .maps = s->maps};
    const io_procedural p = {.seed = 1};
    io_procedural_make(&p, s->next++, &m);
}

/* The same network and steps for the peers. */
static void peer_job(const subject *s, char *job, size_t size)
{
    bench_peer_network("train", &s->model->arch, s->steps, job, (int)size);
    const size_t n = strlen(job);
    snprintf(job + n, size - n, " %d %d %d %d", s->c.train.batch, s->c.data.patch, s->in.grid.w, s->model->fixed[NN_G]);
}

static double megabytes(subject *s, int steps, bool recompute)
{
    ts_status st = {0};
    ag_tape *kept = s->tape;
    s->tape = ag_tape_create(true, &st);
    if (!s->tape) abort();
    s->steps = steps;
    s->in.recompute = recompute;
    step(s);
    step(s);
    const double most = (double)ts_arena_peak(ag_arena(s->tape)) / (1 << 20);
    ag_tape_destroy(&s->tape);
    s->tape = kept;
    return most;
}

/* Of the gradients of a first convolution: those of its constants are not made, nor any of its input in a first step
 * whose R_0 is fixed. */
static double not_made(const subject *s, const char *conv, int steps, bool fixed)
{
    const int images = s->model->arch.images;
    return steps > 0 ? bench_network_flop(s->model, conv, s->in.grid.w) * (steps * images + fixed) / (1 + images) : 0;
}

static void measure(subject *s)
{
    const int batch = s->c.train.batch, side = s->in.grid.w;
    char label[96];
    const int coarse = s->steps < s->model->arch.coarse_steps ? s->steps : s->model->arch.coarse_steps;
    const double g = bench_network_flop(s->model, "g.", side), h = bench_network_flop(s->model, "h.", side),
                 c = bench_network_flop(s->model, "coarse.", side);
    const bool *fixed = s->model->fixed;
    const double of_coarse = fixed[NN_COARSE] ? coarse * c
                                              : 3 * coarse * c - not_made(s, "coarse.conv1", coarse, fixed[NN_G]);
    const double of_h = 3 * (s->steps - coarse) * h -
        not_made(s, "h.conv1", s->steps - coarse, fixed[NN_G] && (coarse == 0 || fixed[NN_COARSE]));
    const double flop = batch * ((fixed[NN_G] ? 1 : 3) * g + of_coarse + of_h);
    snprintf(label, sizeof label, "%d patches of %d^2, window %d, T = %d%s", batch, s->c.data.patch, side, s->steps,
             fixed[NN_G] ? ", g fixed" : "");
    ag_compute_set(s->tape, (ts_compute){.exact = true});
    bench_row("  all convolutions computed directly", bench_measure(step, s), flop);
    ag_compute_set(s->tape, (ts_compute){0});
    const bench_time t = bench_measure(step, s);
    bench_row(label, t, flop);
    enum { ROUNDED = 5 };
    char job[256] = "bf16 ";
    peer_job(s, job + ROUNDED, sizeof job - ROUNDED);
    bench_row_peers(t, flop, job + ROUNDED);
    bench_row_threads(step, s);
    ag_compute_set(s->tape, (ts_compute){.precision = TS_BF16});
    bench_time rounded = bench_measure(step, s);
    bench_row(bench_bf16(&rounded) ? "  in bf16" : "  in bf16, emulated", rounded, flop);
    bench_row_peers(rounded, flop, job);
    ag_compute_set(s->tape, (ts_compute){0});
    bench_time part = bench_measure(losses, s);
    bench_row_unit(s->steps > 0 ? "  of which both losses, 9 renderings each" : "  of which the loss, 9 renderings",
                   part, 100 * part.seconds / t.seconds, "% of the step");
    part = bench_measure(material, s);
    part.seconds *= batch;
    bench_row_unit("  its materials, one thread beside it", part, 100 * part.seconds / t.seconds, "% of the step");
    const int trained = s->steps;
    if (trained == 0) return;
    const nn_arch *a = &s->model->arch;
    const double states = (double)batch * side * side * (a->channels + (a->h_width ? 2 * a->h_gru : 0)) *
        sizeof(float) / (1 << 20);
    const double plain = megabytes(s, trained, false), few = megabytes(s, trained, true), many = megabytes(s, 24, true);
    printf("  memory: %.0f MiB; with train.checkpoint_steps %.0f MiB, and %.0f MiB at T = 24: %.2f MiB a step more, "
           "R_t and the states are %.2f MiB\n",
           plain, few, many, (many - few) / (24 - trained), states);
}

static void train(const char *config, const char *heading, void (*rows)(subject *s))
{
    ts_status st = {0};
    subject s = {.c = tr_config_default(), .tape = ag_tape_create(true, &st)};
    bench_heading(heading);
    if (!s.tape || tr_config_read(&s.c, config, &st) || !(s.model = nn_model_create(&s.c.arch, &st)) ||
        nn_model_train(s.model, &st) || nn_adam_create(&s.adam, s.model, 0, &st)) {
        printf("  %s\n", st.message);
        ag_tape_destroy(&s.tape);
        nn_model_free(&s.model);
        nn_adam_free(&s.adam);
        return;
    }
    nn_model_init(s.model, 1);
    const int patch = s.c.data.patch, side = s.c.train.window ? s.c.train.window : patch;
    const size_t batch = (size_t)s.c.train.batch, pixels = (size_t)patch * (size_t)patch,
                 part = (size_t)side * (size_t)side;
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    s.maps = malloc(pixels * MAP_CHANNELS * sizeof(float));
    s.images = malloc(batch * pixels * 3 * sizeof(float));
    s.window = malloc(batch * part * MAP_CHANNELS * sizeof(float));
    s.goal = malloc(batch * part * MAP_CHANNELS * sizeof(float));
    s.views = malloc(batch * RD_LOSS_VIEWS * sizeof *s.views);
    float *shown = malloc(batch * part * 3 * sizeof(float));
    if (!s.maps || !s.images || !s.window || !s.goal || !s.views || !shown) abort();
    for (size_t i = 0; i < batch * pixels * 3; i++) s.images[i] = ts_rng_uniform(&rng);
    for (size_t i = 0; i < batch * part * 3; i++) shown[i] = ts_rng_uniform(&rng);
    for (size_t i = 0; i < batch * part * MAP_CHANNELS; i++)
        s.window[i] = ts_rng_range(&rng, -0.5f, 0.5f), s.goal[i] = ts_rng_range(&rng, -0.5f, 0.5f);
    for (size_t i = 0; i < batch; i++) rd_loss_views(&rng, s.views + i * RD_LOSS_VIEWS);
    s.model->fixed[NN_G] = s.c.train.steps && s.c.train.g_rate == 0;
    s.model->fixed[NN_COARSE] = s.c.train.coarse_rate == 0;
    s.steps = !s.c.train.steps ? 0 : s.c.train.iterations_max ? s.c.train.iterations_max : s.c.arch.iterations;
    s.in = (nn_input){.image = ts_view(shown, (ts_shape){(int)batch, side, side, 3}),
                      .grid = {.h = side, .w = side, .side = patch},
                      .view = rd_flash()};
    if (side < patch) s.in.whole = ts_view(s.images, (ts_shape){(int)batch, patch, patch, 3});
    rows(&s);
    if (ag_status(s.tape)->code) printf("  %s\n", ag_status(s.tape)->message);
    ag_tape_destroy(&s.tape);
    nn_model_free(&s.model);
    nn_adam_free(&s.adam);
    free(s.maps), free(s.images), free(s.window), free(s.goal), free(s.views), free(shown);
}

BENCH(train)
{
    train("configs/single.ini",
          "a training step of configs/single.ini: g, the coarse steps with their Newton steps (which the peers do not "
          "have; their gradient is of the photograph at g's size), losses, all gradients that are asked for, Adam",
          measure);
}
BENCH(train_g) { train("configs/single-g.ini", "a training step of configs/single-g.ini: g alone", measure); }
BENCH(train_both)
{
    train("configs/ablation/t6.ini", "a training step of configs/ablation/t6.ini: g and h together", measure);
}

static void beside_others(subject *s) { bench_load("configs/single-g.ini", step, s); }
BENCH(load_train)
{
    train("configs/single-g.ini", "a training step on a machine that does other things too", beside_others);
}
