/* The ops between the convolutions at training shapes, forward and backward, as memory traffic: the bytes that an op
 * cannot avoid (inputs and output once; backward the output's gradient, what it needs of the values, and the inputs'
 * gradients) over its time. */
#include "autograd/op.h"
#include "bench/bench.h"
#include "ops.h"
#include "tensor/kernels/adam.h"
#include "tensor/memory.h"
#include "tensor/team.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = 8, SIDE = 64, C = 64 };
static const ts_shape image = {N, SIDE, SIDE, C};

typedef struct job {
    ag_tape *tape;
    ag_node *node;
} job;

static void run_forward(void *user)
{
    job *j = user;
    const ts_mark mark = ts_arena_mark(ag_arena(j->tape));
    j->node->op->forward(j->tape, j->node); /* what it saves lands where the last call's did */
    ts_arena_release(ag_arena(j->tape), mark);
}

static void run_backward(void *user)
{
    job *j = user;
    for (int i = 0; i < j->node->inputs; i++)
        if (j->node->in[i]) j->node->in[i]->grad_ready = false; /* the first to write, as most are */
    const ts_mark mark = ts_arena_mark(ag_arena(j->tape));
    j->node->op->backward(j->tape, j->node);
    ts_arena_release(ag_arena(j->tape), mark);
}

static ag_value *random_value(ag_tape *tape, ts_rng *r, ts_shape s)
{
    const size_t count = (size_t)ts_count(s);
    ts_tensor t = ts_new(ag_arena(tape), s);
    float *grad = ts_arena_zalloc(ag_arena(tape), count, sizeof(float));
    if (!t.data || !grad) abort();
    for (size_t i = 0; i < count; i++) t.data[i] = ts_rng_range(r, -1, 1);
    return ag_parameter(tape, t, grad);
}

/* read: what backward reads beside the output's gradient, in floats */
static void rows(ag_tape *tape, ag_value *out, double read)
{
    if (!out) {
        fprintf(stderr, "%s\n", ag_status(tape)->message);
        abort();
    }
    job j = {tape, (ag_node *)(uintptr_t)ag_node_of(tape, out)}; /* the tape's own node, which its op may write to */
    const double made = (double)ts_count(out->t.shape);
    double given = 0;
    for (int i = 0; i < j.node->inputs; i++)
        if (j.node->in[i]) given += (double)ts_count(j.node->in[i]->t.shape);
    bool accumulate;
    float *dy = ag_grad_target(tape, out, &accumulate);
    if (!dy) abort();
    for (int64_t i = 0; i < ts_count(out->t.shape); i++) dy[i] = out->t.data[i];
    char label[64];
    bench_time t = bench_measure(run_forward, &j);
    snprintf(label, sizeof label, "%s", j.node->op->name);
    bench_row_unit(label, t, 4e-9 * (given + made) / t.seconds, "GB/s");
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    if (j.node->saved) j.node->op->forward(tape, j.node); /* saved again, below what backward allocates */
    t = bench_measure(run_backward, &j);
    ts_arena_release(ag_arena(tape), mark);
    snprintf(label, sizeof label, "%s backward", j.node->op->name);
    bench_row_unit(label, t, 4e-9 * (given + made + read) / t.seconds, "GB/s");
}

typedef struct block {
    float *p, *g, *m, *v;
    double sum;
} block;

enum { PARAMETERS = 1 << 22, PART = 1 << 16 };

static void adam_range(const void *user, int64_t begin, int64_t end)
{
    const block *b = user;
    for (int64_t i = begin; i < end; i += PART)
        ts_adam_k()->step(PART, b->p + i, b->g + i, b->m + i, b->v + i, 0.9f, 0.999f, 1e-3f, 1e-8f, 1.0f);
}

static void adam(void *user) { ts_for(0, PARAMETERS, PART, adam_range, user); }

static void norm(void *user)
{
    block *b = user;
    b->sum = ts_adam_k()->sum_of_squares(PARAMETERS, b->g);
}

static void copy(void *user)
{
    const block *b = user;
    ts_memory_copy(b->m, b->g, PARAMETERS * sizeof(float), 0);
}

BENCH(ops)
{
    ag_tape *tape = ag_tape_create(true, NULL);
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, 0);
    block b = {calloc(PARAMETERS, sizeof(float)), calloc(PARAMETERS, sizeof(float)), calloc(PARAMETERS, sizeof(float)),
               calloc(PARAMETERS, sizeof(float)), 0};
    if (!tape || !b.p || !b.g || !b.m || !b.v) abort();
    bench_heading("ops at [8,64,64,64]");
    bench_time t = bench_measure(copy, &b);
    bench_row_unit("memcpy, 16 MiB", t, 8e-9 * PARAMETERS / t.seconds, "GB/s");
    ag_value *x = random_value(tape, &r, image), *y = random_value(tape, &r, image),
             *g = random_value(tape, &r, (ts_shape){N, 1, 1, C});
    const double n = (double)ts_count(image);
    rows(tape, ag_leaky(tape, x, 0.2f), n);
    rows(tape, ag_tanh(tape, x), n);
    rows(tape, ag_selu(tape, x), n);
    rows(tape, ag_add(tape, x, y), 0);
    rows(tape, ag_scale(tape, x, 0.5f), 0);
    rows(tape, ag_concat(tape, x, y), 0);
    rows(tape, ag_instance_norm(tape, x, 1e-5f), n);
    rows(tape, ag_channel_mean(tape, x), 0);
    rows(tape, ag_add_leaky(tape, x, g, 0.2f), n);
    rows(tape, ag_max_pool(tape, x), n);
    rows(tape, ag_upsample(tape, x), 0);
    rows(tape, ag_resize(tape, x, 2 * SIDE, 2 * SIDE), 0);
    ag_value *one = random_value(tape, &r, (ts_shape){1, 1, 1, 96});
    rows(tape,
         ag_gru(tape, x, random_value(tape, &r, (ts_shape){N, SIDE, SIDE, 32}),
                random_value(tape, &r, (ts_shape){96, C, 1, 1}), one, random_value(tape, &r, (ts_shape){96, 32, 1, 1}),
                one),
         7 * n / 2);
    ag_value *weight = random_value(tape, &r, (ts_shape){1, 1, 256, 512}),
             *bias = random_value(tape, &r, (ts_shape){1, 1, 1, 256});
    rows(tape, ag_linear(tape, random_value(tape, &r, (ts_shape){N, 1, 1, 512}), weight, bias), 256 * 512);
    t = bench_measure(adam, &b);
    bench_row_unit("Adam, 4 M parameters", t, 28e-9 * PARAMETERS / t.seconds, "GB/s");
    t = bench_measure(norm, &b);
    bench_row_unit("sum of squares, 4 M, one thread", t, 4e-9 * PARAMETERS / t.seconds, "GB/s");
    ag_tape_destroy(&tape);
    free(b.p);
    free(b.g);
    free(b.m);
    free(b.v);
}
