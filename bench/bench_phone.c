/* g at full detail, as configs/single-phone.ini has it: what it says of one photograph, and a step of its training. */
#include "bench/bench.h"
#include "bench/shape.h"
#include "nn/model.h"
#include "ops.h"
#include "train/state.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char config[] = "configs/single-phone.ini";
enum { ROUNDED = 5 }; /* length of "bf16 " */

typedef struct subject {
    tr_trainer t; /* what the loss reads of it */
    nn_input in;
    float *goal;
} subject;

static void guess(void *user)
{
    subject *s = user;
    nn_guess g;
    const ts_mark mark = ag_scope_begin(s->t.tape);
    nn_guess_from(s->t.tape, s->t.model, &s->in, &g);
    ag_scope_end(s->t.tape, mark, NULL, 0);
}

static ag_value *goal_of(subject *s)
{
    const int side = s->in.grid.side;
    return ag_constant(s->t.tape, ts_view(s->goal, (ts_shape){s->t.batch, side, side, MAP_CHANNELS}));
}

static void step(void *user)
{
    subject *s = user;
    tr_row row;
    size_t first, last;
    ag_reset(s->t.tape);
    ag_backward(s->t.tape, tr_guess_loss(&s->t, &s->in, goal_of(s), &row));
    nn_adam_next(&s->t.adam);
    nn_model_range(s->t.model, NN_G, &first, &last);
    nn_gradient_norm(s->t.model, first, last);
    nn_adam_step(&s->t.adam, s->t.model, first, last, 1e-4f, 1);
}

/* The rows of one precision, below what is already said of the other. */
static void rows(subject *s, void (*work)(void *), const char *label, double flop, char *job)
{
    for (int rounded = 0; rounded < 2; rounded++) {
        char text[128];
        ag_compute_set(s->t.tape, (ts_compute){.precision = rounded ? TS_BF16 : TS_F32});
        bench_time t = bench_measure(work, s);
        snprintf(text, sizeof text, "%s%s", label, !rounded ? "" : bench_bf16(&t) ? ", bf16" : ", bf16, emulated");
        bench_row(text, t, flop);
        bench_row_peers(t, flop, rounded ? job : job + ROUNDED);
        if (!rounded) bench_row_threads(work, s);
    }
}

static bool begin(subject *s, int batch, bool training)
{
    ts_status st = {0};
    tr_trainer *t = &s->t;
    t->config = tr_config_default();
    t->tape = ag_tape_create(training, &st);
    t->batch = batch;
    if (!t->tape || tr_config_read(&t->config, config, &st) || !(t->model = nn_model_create(&t->config.arch, &st)) ||
        (training && (nn_model_train(t->model, &st) || nn_adam_create(&t->adam, t->model, 0, &st)))) {
        printf("  %s\n", st.message);
        return false;
    }
    nn_model_init(t->model, 1);
    ag_freeze(t->tape, !training);
    const int side = nn_arch_side(&t->config.arch);
    const size_t pixels = (size_t)batch * (size_t)side * (size_t)side;
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    t->images = malloc(pixels * 3 * sizeof(float));
    s->goal = malloc(pixels * MAP_CHANNELS * sizeof(float));
    t->scenes = calloc((size_t)batch, RD_SCENE_NUMBERS * sizeof(float));
    t->known = calloc((size_t)batch, 1);
    t->views = malloc((size_t)batch * RD_LOSS_VIEWS * sizeof *t->views);
    if (!t->images || !s->goal || !t->scenes || !t->known || !t->views) abort();
    for (size_t i = 0; i < pixels * 3; i++) t->images[i] = ts_rng_uniform(&rng);
    for (size_t i = 0; i < pixels * MAP_CHANNELS; i++) s->goal[i] = ts_rng_range(&rng, -0.5f, 0.5f);
    for (int i = 0; i < batch; i++) rd_loss_views(&rng, t->views + i * RD_LOSS_VIEWS);
    s->in = (nn_input){.image = ts_view(t->images, (ts_shape){batch, side, side, 3}),
                       .grid = rd_grid_full(side),
                       .view = rd_flash(),
                       .known = t->known};
    return true;
}

static void end(subject *s)
{
    tr_trainer *t = &s->t;
    if (t->tape && ag_status(t->tape)->code) printf("  %s\n", ag_status(t->tape)->message);
    ag_tape_destroy(&t->tape);
    nn_model_free(&t->model);
    nn_adam_free(&t->adam);
    free(t->images), free(s->goal), free(t->scenes), free(t->known), free(t->views);
}

BENCH(phone_infer)
{
    subject s = {0};
    char job[256] = "bf16 ";
    bench_heading("g of configs/single-phone.ini: R_0 of one photograph, its errors and the scene");
    if (begin(&s, 1, false)) {
        bench_peer_guess("guess", &s.t.config.arch, job + ROUNDED, sizeof job - ROUNDED);
        rows(&s, guess, "g at full detail", bench_network_flop(s.t.model, "g.", 0), job);
    }
    end(&s);
}

BENCH(phone_train)
{
    subject s = {0};
    char job[256] = "bf16 ", label[64];
    bench_heading("a training step of configs/single-phone.ini: g, losses, all gradients, Adam");
    tr_config c = tr_config_default();
    ts_status st = {0};
    if (tr_config_read(&c, config, &st) == TS_OK && begin(&s, c.train.batch, true)) {
        bench_peer_guess("train_guess", &s.t.config.arch, job + ROUNDED, sizeof job - ROUNDED);
        snprintf(job + strlen(job), sizeof job - strlen(job), " %d", s.t.batch);
        snprintf(label, sizeof label, "%d patches of %d^2", s.t.batch, s.in.grid.side);
        rows(&s, step, label, 3 * s.t.batch * bench_network_flop(s.t.model, "g.", 0), job);
    }
    end(&s);
}
