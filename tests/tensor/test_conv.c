#include "tensor/conv/conv.h"
#include "tensor/cpu.h"
#include "tensor/kernels/conv.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/support/conv_shapes.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 64 };
static const uint32_t canary = 0x7fc0beefu; /* a NaN: reading it into a result shows too */

/* Results lie between two guards; inputs have none, so that the sanitizer sees a read past their end. */
typedef struct buffer {
    float *memory, *data;
    size_t count;
    int guard;
} buffer;

static buffer make_guarded(size_t count, int guard)
{
    CHECK(count < (size_t)1 << 30, "a buffer of %zu floats", count);
    const size_t all = count + 2 * (size_t)guard;
    buffer b = {malloc(all * sizeof(float)), NULL, count, guard};
    CHECK(b.memory, "no memory");
    b.data = b.memory + guard;
    for (size_t i = 0; i < all; i++) memcpy(b.memory + i, &canary, sizeof canary);
    return b;
}

static buffer make(size_t count) { return make_guarded(count, GUARD); }

static buffer make_random(size_t count, ts_rng *r)
{
    buffer b = make_guarded(count, 0);
    for (size_t i = 0; i < count; i++) b.data[i] = ts_rng_range(r, -1, 1);
    return b;
}

static void finish(buffer *b, const char *name)
{
    for (int i = 0; i < b->guard; i++) {
        CHECK(memcmp(b->memory + i, &canary, sizeof canary) == 0, "%s: written %d floats before its begin", name,
              b->guard - i);
        CHECK(memcmp(b->data + b->count + i, &canary, sizeof canary) == 0, "%s: written %d floats after its end", name,
              i);
    }
    free(b->memory);
}

static const char *describe(const ts_conv *c)
{
    static char text[160];
    snprintf(text, sizeof text, "%s, %d threads, n %d, %d x %d, %d to %d channels, side %d, dilation %d, %s",
             ts_isa_name(ts_isa_now()), ts_threads(), c->n, c->h, c->w, c->ic, c->oc, c->k, c->dilation,
             c->pad == TS_PAD_ZERO ? "zero" : "replicate");
    return text;
}

/* Sums of count products of values in [-1, 1] in another order. */
static void same(const buffer *a, const buffer *b, double count, const char *what, const ts_conv *c)
{
    const double bound = 2e-7 * (4 + count);
    for (size_t i = 0; i < a->count; i++)
        CHECK(fabs((double)a->data[i] - b->data[i]) <= bound, "%s differs at %zu: %.9g, naive %.9g (%s)", what, i,
              a->data[i], b->data[i], describe(c));
}

typedef struct problem {
    ts_conv c;
    buffer x, weight, bias, dy;
    float leak;
} problem;

static size_t in_count(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->ic; }
static size_t variable_count(const ts_conv *c) { return in_count(c) / (size_t)c->ic * (size_t)ts_conv_variables(c); }
static size_t out_count(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->oc; }
static size_t weight_count(const ts_conv *c) { return (size_t)c->ic * (size_t)c->oc * (size_t)(c->k * c->k); }

static problem make_problem(ts_conv c, ts_rng *r)
{
    static const float leaks[] = {1, 0.2f, 0};
    return (problem){c,
                     make_random(in_count(&c), r),
                     make_random(weight_count(&c), r),
                     make_random((size_t)c.oc, r),
                     make_random(out_count(&c), r),
                     leaks[ts_rng_int(r, 3)]};
}

static void finish_problem(problem *p)
{
    finish(&p->x, "x");
    finish(&p->weight, "weight");
    finish(&p->bias, "bias");
    finish(&p->dy, "dy");
}

static buffer packed(const problem *p, ts_conv_use use)
{
    buffer b = make(ts_conv_packed_count(&p->c, use));
    ts_conv_pack(&p->c, use, p->weight.data, b.data);
    return b;
}

static buffer forward(const problem *p, bool bias)
{
    buffer w = packed(p, TS_CONV_FORWARD), y = make(out_count(&p->c));
    ts_conv_forward(&p->c, &(ts_conv_inputs){.x = p->x.data, .bias = bias ? p->bias.data : NULL}, w.data, p->leak,
                    y.data);
    finish(&w, "packed");
    return y;
}

/* start != NULL: accumulates onto it */
static buffer data_gradient(const problem *p, const buffer *start)
{
    buffer w = packed(p, TS_CONV_DATA_GRADIENT), dx = make(variable_count(&p->c));
    if (start) memcpy(dx.data, start->data, dx.count * sizeof(float)); /* start may be longer */
    ts_conv_data_gradient(&p->c, p->dy.data, w.data, dx.data, start != NULL);
    finish(&w, "packed");
    return dx;
}

static void check_forward(const problem *p)
{
    const double terms = (double)p->c.ic * p->c.k * p->c.k;
    for (int bias = 0; bias < 2; bias++) {
        buffer y = forward(p, bias), naive = make(y.count);
        ts_conv_forward_naive(&p->c, &(ts_conv_inputs){.x = p->x.data, .bias = bias ? p->bias.data : NULL},
                              p->weight.data, p->leak, naive.data);
        same(&y, &naive, terms, "forward", &p->c);
        finish(&y, "y");
        finish(&naive, "naive y");
    }
}

static void check_data_gradient(const problem *p)
{
    const double terms = (double)p->c.oc * p->c.k * p->c.k * p->c.k * p->c.k;
    for (int i = 0; i < 4; i++) {
        const bool add = i % 2;
        problem q = *p;
        q.c.constants = i / 2 ? p->c.ic / 2 : 0; /* of a single channel none */
        buffer dx = data_gradient(&q, add ? &p->x : NULL), naive = make(dx.count);
        memcpy(naive.data, p->x.data, naive.count * sizeof(float));
        ts_conv_data_gradient_naive(&q.c, p->dy.data, p->weight.data, naive.data, add);
        same(&dx, &naive, terms, add ? "added data gradient" : "data gradient", &q.c);
        finish(&dx, "dx");
        finish(&naive, "naive dx");
    }
}

static void check_weight_gradient(const problem *p)
{
    const double terms = (double)p->c.n * p->c.h * p->c.w;
    buffer dw = make(p->weight.count), db = make(p->bias.count), naive_dw = make(dw.count), naive_db = make(db.count);
    memcpy(dw.data, p->weight.data, dw.count * sizeof(float)); /* added to what is there */
    memcpy(db.data, p->bias.data, db.count * sizeof(float));
    memcpy(naive_dw.data, p->weight.data, dw.count * sizeof(float));
    memcpy(naive_db.data, p->bias.data, db.count * sizeof(float));
    ts_conv_weight_gradient(&p->c, p->x.data, p->dy.data, dw.data, db.data);
    ts_conv_weight_gradient_naive(&p->c, p->x.data, p->dy.data, naive_dw.data, naive_db.data);
    same(&dw, &naive_dw, terms, "weight gradient", &p->c);
    same(&db, &naive_db, terms, "bias gradient", &p->c);
    /* Either may be absent, and the other is the same. */
    ts_conv_weight_gradient(&p->c, p->x.data, p->dy.data, dw.data, NULL);
    ts_conv_weight_gradient_naive(&p->c, p->x.data, p->dy.data, naive_dw.data, NULL);
    ts_conv_weight_gradient(&p->c, p->x.data, p->dy.data, NULL, db.data);
    ts_conv_weight_gradient_naive(&p->c, p->x.data, p->dy.data, NULL, naive_db.data);
    same(&dw, &naive_dw, 2 * terms, "weight gradient alone", &p->c);
    same(&db, &naive_db, 2 * terms, "bias gradient alone", &p->c);
    finish(&dw, "dweight");
    finish(&db, "dbias");
    finish(&naive_dw, "naive dweight");
    finish(&naive_db, "naive dbias");
}

static void against_naive(void (*check)(const problem *p), uint64_t seed)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 150; i++) {
            problem p = make_problem(any_conv(&r, 2e6), &r);
            check(&p);
            finish_problem(&p);
        }
    }
}

TEST(conv_forward_naive) { against_naive(check_forward, 1); }
TEST(conv_data_gradient_naive) { against_naive(check_data_gradient, 2); }
TEST(conv_weight_gradient_naive) { against_naive(check_weight_gradient, 3); }

/* Shapes that the random ones seldom or never reach. */
TEST(conv_chosen_shapes)
{
    static const ts_conv shapes[] = {
        {1, 1, 1, 1, 1, 15, 2, TS_PAD_REPLICATE, 0, {0}},    {2, 1, 1, 3, 2, 15, 2, TS_PAD_ZERO, 0, {0}},
        {1, 1, 300, 3, 9, 3, 1, TS_PAD_REPLICATE, 0, {0}},   {1, 300, 1, 9, 3, 5, 2, TS_PAD_REPLICATE, 0, {0}},
        {1, 3, 211, 2, 33, 5, 1, TS_PAD_ZERO, 0, {0}},       {4, 2, 2, 512, 40, 3, 1, TS_PAD_ZERO, 0, {0}},
        {1, 2, 3, 512, 33, 3, 1, TS_PAD_REPLICATE, 0, {0}},  {1, 5, 4, 40, 512, 3, 2, TS_PAD_REPLICATE, 0, {0}},
        {1, 3, 3, 700, 5, 7, 1, TS_PAD_ZERO, 0, {0}},        {1, 9, 7, 5, 700, 7, 1, TS_PAD_REPLICATE, 0, {0}},
        {9, 8, 8, 16, 16, 5, 2, TS_PAD_REPLICATE, 0, {0}},   {5, 8, 8, 3, 20, 5, 1, TS_PAD_ZERO, 0, {0}},
        {1, 40, 40, 18, 33, 1, 1, TS_PAD_ZERO, 0, {0}},      {17, 2, 2, 33, 65, 5, 1, TS_PAD_ZERO, 0, {0}},
        {1, 64, 64, 3, 16, 3, 1, TS_PAD_ZERO, 0, {0}},       {2, 33, 64, 16, 9, 3, 2, TS_PAD_REPLICATE, 0, {0}},
        {2, 20, 70, 24, 10, 5, 2, TS_PAD_REPLICATE, 0, {0}}, {1, 17, 150, 48, 9, 3, 1, TS_PAD_REPLICATE, 0, {0}},
        {1, 7, 80, 80, 10, 5, 2, TS_PAD_ZERO, 0, {0}},       {1, 9, 80, 9, 90, 5, 2, TS_PAD_REPLICATE, 0, {0}},
        {2, 5, 70, 10, 70, 5, 1, TS_PAD_REPLICATE, 0, {0}},
    };
    ts_rng r = ts_rng_make(4, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
            problem p = make_problem(shapes[i], &r);
            check_forward(&p);
            check_data_gradient(&p);
            check_weight_gradient(&p);
            finish_problem(&p);
        }
    }
}

/* Few channels: blocks of columns end before, at and behind what padding folds onto the border. */
TEST(conv_blocks_of_columns)
{
    ts_rng r = ts_rng_make(9, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        const int lanes = ts_conv_k()->lanes;
        for (int blocks = 4; blocks <= 8; blocks += 2)
            for (int off = -5; off <= 5; off++) {
                const ts_conv c = {1,
                                   2 + ts_rng_int(&r, 3),
                                   blocks * lanes + off,
                                   1 + ts_rng_int(&r, 40),
                                   1 + ts_rng_int(&r, lanes),
                                   ts_rng_int(&r, 2) ? 3 : 5,
                                   1 + ts_rng_int(&r, 2),
                                   ts_rng_int(&r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE,
                                   0,
                                   {0}};
                ts_conv back = c;
                back.ic = c.oc, back.oc = c.ic;
                problem p = make_problem(c, &r), q = make_problem(back, &r);
                check_forward(&p), check_data_gradient(&q);
                finish_problem(&p), finish_problem(&q);
            }
    }
}

static double dot(const buffer *a, const buffer *b)
{
    double s = 0;
    for (size_t i = 0; i < a->count; i++) s += (double)a->data[i] * b->data[i];
    return s;
}

/* <conv(x), dy> = <x, dgrad(dy)> = <w, wgrad(x, dy)>: exact in integers small enough that float sums do not round. */
TEST(conv_adjoint)
{
    ts_rng r = ts_rng_make(5, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 150; i++) {
            problem p = make_problem(any_conv(&r, 2e6), &r);
            buffer *const inputs[] = {&p.x, &p.weight, &p.dy};
            for (int b = 0; b < 3; b++)
                for (size_t j = 0; j < inputs[b]->count; j++) inputs[b]->data[j] = (float)(ts_rng_int(&r, 5) - 2);
            p.leak = 1;
            buffer y = forward(&p, false), dx = data_gradient(&p, NULL), dw = make(p.weight.count);
            memset(dw.data, 0, dw.count * sizeof(float));
            ts_conv_weight_gradient(&p.c, p.x.data, p.dy.data, dw.data, NULL);
            const double a = dot(&y, &p.dy), b = dot(&p.x, &dx), c = dot(&p.weight, &dw);
            CHECK(a == b && a == c, "<conv(x), dy> = %.17g, <x, dgrad(dy)> = %.17g, <w, wgrad(x, dy)> = %.17g (%s)", a,
                  b, c, describe(&p.c));
            finish(&y, "y");
            finish(&dx, "dx");
            finish(&dw, "dweight");
            finish_problem(&p);
        }
    }
}

TEST(conv_same_bytes_for_any_threads)
{
    static const ts_conv shapes[] = {
        {3, 37, 41, 18, 40, 5, 1, TS_PAD_REPLICATE, 0, {0}}, {1, 8, 8, 96, 130, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 4, 4, 48, 66, 5, 1, TS_PAD_ZERO, 0, {0}},        {2, 64, 50, 20, 9, 3, 2, TS_PAD_REPLICATE, 0, {0}},
        {2, 30, 31, 33, 70, 1, 1, TS_PAD_ZERO, 0, {0}},      {1, 6, 5, 700, 33, 7, 1, TS_PAD_REPLICATE, 0, {0}},
    };
    static const int threads[] = {1, 2, 3, 7};
    ts_rng r = ts_rng_make(6, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
            problem p = make_problem(shapes[i], &r);
            buffer first[4];
            for (int t = 0; t < 4; t++) {
                ts_threads_set(threads[t]);
                buffer now[4] = {forward(&p, true), data_gradient(&p, NULL), make(p.weight.count), make(p.bias.count)};
                memset(now[2].data, 0, now[2].count * sizeof(float));
                memset(now[3].data, 0, now[3].count * sizeof(float));
                ts_conv_weight_gradient(&p.c, p.x.data, p.dy.data, now[2].data, now[3].data);
                for (int b = 0; b < 4; b++) {
                    static const char *const names[] = {"forward", "data gradient", "weight gradient", "bias gradient"};
                    if (t == 0) first[b] = now[b];
                    else {
                        CHECK(memcmp(first[b].data, now[b].data, now[b].count * sizeof(float)) == 0,
                              "%s: other bytes than with one thread (%s)", names[b], describe(&p.c));
                        finish(&now[b], names[b]);
                    }
                }
            }
            for (int b = 0; b < 4; b++) finish(&first[b], "result");
            finish_problem(&p);
        }
    }
}

/* Sums of 12,800 products: parts of bounded length keep the error near a ten-millionth, one running sum would make 2e-6
 * of it. */
TEST(conv_long_sums_stay_accurate)
{
    const ts_conv c = {.n = 1, .h = 6, .w = 5, .ic = 512, .oc = 33, .k = 5, .dilation = 1, .pad = TS_PAD_REPLICATE};
    ts_rng r = ts_rng_make(9, TS_STREAM_TEST, 0);
    const size_t count = (size_t)c.h * (size_t)c.w * (size_t)c.oc;
    buffer x = make_random((size_t)(c.h * c.w * c.ic), &r), w = make_random((size_t)(c.oc * c.ic * c.k * c.k), &r),
           y = make(count), y2 = make(count);
    ts_conv_forward_naive(&c, &(ts_conv_inputs){.x = x.data}, w.data, 1, y2.data);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        buffer packed = make(ts_conv_packed_count(&c, TS_CONV_FORWARD));
        ts_conv_pack(&c, TS_CONV_FORWARD, w.data, packed.data);
        ts_conv_forward(&c, &(ts_conv_inputs){.x = x.data}, packed.data, 1, y.data);
        double error = 0, size = 0;
        for (size_t i = 0; i < count; i++) {
            error += ((double)y.data[i] - y2.data[i]) * ((double)y.data[i] - y2.data[i]);
            size += (double)y2.data[i] * y2.data[i];
        }
        printf("  %s: %.2g\n", ts_isa_name((ts_isa)isa), sqrt(error / size));
        CHECK(error < 4e-7 * 4e-7 * size, "%s: relative error %g", ts_isa_name((ts_isa)isa), sqrt(error / size));
        finish(&packed, "packed");
    }
}

TEST(conv_check_refuses)
{
    const ts_conv good = {1, 4, 4, 3, 5, 3, 1, TS_PAD_ZERO, 0, {0}};
    CHECK(ts_conv_check(&good, NULL) == TS_OK, "a good shape is refused");
    for (int i = 0; i < 11; i++) {
        ts_conv c = good;
        if (i == 0) c.n = 0;
        if (i == 1) c.h = 0;
        if (i == 2) c.w = -1;
        if (i == 3) c.ic = 0;
        if (i == 4) c.oc = 0;
        if (i == 5) c.k = 2;
        if (i == 6) c.k = 17;
        if (i == 7) c.dilation = 3;
        if (i == 8) c.n = c.h = c.w = c.ic = 1 << 20;
        if (i == 9) c.constants = c.ic;
        if (i == 10) c.constants = -1;
        ts_status st = {0};
        CHECK(ts_conv_check(&c, &st) == TS_INVALID && st.message[0], "bad shape %d is accepted or has no message", i);
    }
}
