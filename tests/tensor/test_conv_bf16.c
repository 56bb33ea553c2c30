#include "autograd/tape.h"
#include "ops.h"
#include "tensor/conv/conv.h"
#include "tensor/conv/gru.h"
#include "tensor/cpu.h"
#include "tensor/kernels/pairs.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/support/conv_shapes.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 64 };

static float from_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t to_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Random values in [-1, 1], or NaN. */
static float *values(size_t count, ts_rng *r)
{
    float *p = malloc((count + 1) * sizeof(float));
    CHECK(p, "no memory");
    for (size_t i = 0; i < count; i++) p[i] = r ? ts_rng_range(r, -1, 1) : NAN;
    return p;
}

static float *rounded(const float *x, size_t count)
{
    float *p = values(count, NULL);
    for (size_t i = 0; i < count; i++) p[i] = ts_bf16_naive(x[i]);
    return p;
}

/* What sits between two floats that have 16 bits less: near the middle, at the edges of exponents, denormal, infinite,
 * and no number. */
static float hard_to_round(ts_rng *r)
{
    static const uint32_t tails[] = {0, 1, 0x7fff, 0x8000, 0x8001, 0xffff},
                          heads[] = {0, 1, 0x7f, 0x80, 0x3f80, 0x7f7f, 0x7f80, 0x7fbf, 0x7fc0, 0x7fff};
    const uint32_t random = ts_rng_u32(r), sign = ts_rng_u32(r) & 0x80000000;
    const uint32_t high = ts_rng_int(r, 2) ? random & 0x7fff0000 : heads[ts_rng_int(r, 10)] << 16;
    return from_bits(sign | high | (ts_rng_int(r, 4) ? tails[ts_rng_int(r, 6)] : random & 0xffff));
}

TEST(bf16_rounding_chosen)
{
    static const uint32_t expected[][2] = {
        {0x3f800000, 0x3f80}, {0x3f808000, 0x3f80}, {0x3f808001, 0x3f81}, {0x3f818000, 0x3f82}, {0x3f817fff, 0x3f81},
        {0xbf818000, 0xbf82}, {0x7f7f7fff, 0x7f7f}, {0x7f7f8000, 0x7f80}, {0x7f7fffff, 0x7f80}, {0xff7fffff, 0xff80},
        {0x7f800000, 0x7f80}, {0xff800000, 0xff80}, {0x00000000, 0x0000}, {0x80000000, 0x8000}, {0x00008000, 0x0000},
        {0x00008001, 0x0001}, {0x007fffff, 0x0080}, {0x80018000, 0x8002}, {0x7f800001, 0x7fc0}, {0xff800001, 0xffc0},
        {0x7fffffff, 0x7fff}, {0x7fc12345, 0x7fc1},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        const uint32_t got = to_bits(ts_bf16_naive(from_bits(expected[i][0])));
        CHECK(got == expected[i][1] << 16, "naive: %08x becomes %08x, not %04x", expected[i][0], got, expected[i][1]);
    }
}

TEST(bf16_pairs_naive)
{
    ts_rng r = ts_rng_make(21, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int t = 0; t < 400; t++) {
            const int channels = 1 + ts_rng_int(&r, 70), pixels = 1 + ts_rng_int(&r, 5), depth = (channels + 1) / 2,
                      gap = ts_rng_int(&r, 2) * 3;
            const size_t count = (size_t)(pixels * (depth + gap)) + GUARD;
            float *x = malloc(sizeof(float) * (size_t)(pixels * channels)),
                  *to = malloc(count * sizeof(float)); /* exact: the sanitizer sees a read past it */
            CHECK(x && to, "no memory");
            for (int i = 0; i < pixels * channels; i++) x[i] = hard_to_round(&r);
            memset(to, 0x5a, count * sizeof(float));
            ts_pairs_k()->of_channels(x, pixels, channels, to, depth + gap);
            for (size_t i = 0; i < count; i++) {
                const int p = (int)i / (depth + gap), d = (int)i % (depth + gap);
                uint32_t want = 0x5a5a5a5a;
                if (p < pixels && d < depth) {
                    want = to_bits(ts_bf16_naive(x[p * channels + 2 * d])) >> 16;
                    if (2 * d + 1 < channels) want |= to_bits(ts_bf16_naive(x[p * channels + 2 * d + 1]));
                }
                CHECK(to_bits(to[i]) == want, "%s: %d pixels of %d channels: pair %d of pixel %d is %08x, not %08x",
                      ts_isa_name((ts_isa)isa), pixels, channels, d, p, to_bits(to[i]), want);
            }
            free(x), free(to);
        }
    }
}

/* What bf16 makes of x; denormals may be zeros. */
static bool is_bf16_of(uint32_t got, float x)
{
    const uint32_t want = to_bits(ts_bf16_naive(x)) >> 16;
    return got == want || (fpclassify(x) == FP_SUBNORMAL && got == (want & 0x8000));
}

TEST(bf16_pairs_of_two_naive)
{
    ts_rng r = ts_rng_make(28, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int t = 0; t < 400; t++) {
            const int count = 1 + ts_rng_int(&r, 70), width = count + ts_rng_int(&r, 20),
                      pixels = 1 + ts_rng_int(&r, 5), step = count + ts_rng_int(&r, 3),
                      to_step = width + ts_rng_int(&r, 3);
            const bool alone = ts_rng_int(&r, 3) == 0;
            const size_t size = (size_t)((pixels - 1) * step + count), all = (size_t)(pixels * to_step) + GUARD;
            float *even = malloc(sizeof(float) * size), *odd = malloc(sizeof(float) * size),
                  *to = malloc(all * sizeof(float)); /* exact: the sanitizer sees a read past it */
            CHECK(even && odd && to, "no memory");
            for (size_t i = 0; i < size; i++) even[i] = hard_to_round(&r), odd[i] = hard_to_round(&r);
            memset(to, 0x5a, all * sizeof(float));
            ts_pairs_k()->of_two(even, alone ? NULL : odd, step, pixels, count, width, to, to_step);
            for (size_t i = 0; i < all; i++) {
                const int p = (int)i / to_step, c = (int)i % to_step;
                const uint32_t got = to_bits(to[i]);
                const bool there = p < pixels && c < count, written = p < pixels && c < width;
                const bool good = !written ? got == 0x5a5a5a5a
                    : !there               ? got == 0
                                           : is_bf16_of(got & 0xffff, even[p * step + c]) &&
                        (alone ? got >> 16 == 0 : is_bf16_of(got >> 16, odd[p * step + c]));
                CHECK(good, "%s: pair %d of pixel %d, of %d and %d, is %08x", ts_isa_name((ts_isa)isa), c, p, count,
                      width, got);
            }
            free(even), free(odd), free(to);
        }
    }
}

static size_t in_count(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->ic; }
static size_t variable_count(const ts_conv *c) { return in_count(c) / (size_t)c->ic * (size_t)ts_conv_variables(c); }
static size_t out_count(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->oc; }
static size_t weight_count(const ts_conv *c) { return (size_t)c->ic * (size_t)c->oc * (size_t)(c->k * c->k); }

typedef struct problem {
    ts_conv c;
    float *x, *weight, *bias, *dy, leak;
} problem;

static problem make_problem(ts_conv c, ts_rng *r)
{
    static const float leaks[] = {1, 0.2f, 0};
    return (problem){c,
                     values(in_count(&c), r),
                     values(weight_count(&c), r),
                     values((size_t)c.oc, r),
                     values(out_count(&c), r),
                     leaks[ts_rng_int(r, 3)]};
}

static void finish(problem *p) { free(p->x), free(p->weight), free(p->bias), free(p->dy); }

/* start != NULL: the gradient is added to it */
static float *run(const problem *p, ts_conv_use use, const float *bias, const float *start)
{
    const bool forward = use == TS_CONV_FORWARD_BF16;
    const size_t count = forward ? out_count(&p->c) : variable_count(&p->c);
    float *packed = values(ts_conv_packed_count(&p->c, use), NULL), *y = values(count + 2 * GUARD, NULL);
    if (start) memcpy(y + GUARD, start, count * sizeof(float));
    ts_conv_pack(&p->c, use, p->weight, packed);
    if (forward) ts_conv_forward_bf16(&p->c, &(ts_conv_inputs){.x = p->x, .bias = bias}, packed, p->leak, y + GUARD);
    else ts_conv_data_gradient_bf16(&p->c, p->dy, packed, y + GUARD, start != NULL);
    for (size_t i = 0; i < GUARD; i++)
        CHECK(isnan(y[i]) && isnan(y[GUARD + count + i]), "written %zu floats outside the result", i);
    memmove(y, y + GUARD, count * sizeof(float));
    free(packed);
    return y;
}

/* Added to the weights themselves. */
static float *gradient_of_weights(const problem *p)
{
    const size_t count = weight_count(&p->c);
    float *dweight = values(count + 2 * GUARD, NULL);
    memcpy(dweight + GUARD, p->weight, count * sizeof(float));
    ts_conv_weight_gradient_bf16(&p->c, &(ts_conv_inputs){.x = p->x}, p->dy, dweight + GUARD);
    for (size_t i = 0; i < GUARD; i++)
        CHECK(isnan(dweight[i]) && isnan(dweight[GUARD + count + i]), "written %zu floats outside the gradient", i);
    memmove(dweight, dweight + GUARD, count * sizeof(float));
    return dweight;
}

/* Products of bf16 values are exact in f32: the bound is that of f32's sums of count products in [-1, 1]. */
static void same(const float *a, const float *naive, size_t n, double count, const char *what, const ts_conv *c)
{
    for (size_t i = 0; i < n; i++)
        CHECK(fabs((double)a[i] - naive[i]) <= 2e-7 * (4 + count),
              "%s: %s differs at %zu: %.9g, naive %.9g (n %d, %d x %d, %d to %d, side %d, dilation %d, %s)",
              ts_isa_name(ts_isa_now()), what, i, a[i], naive[i], c->n, c->h, c->w, c->ic, c->oc, c->k, c->dilation,
              c->pad == TS_PAD_ZERO ? "zero" : "replicate");
}

static void against_naive(ts_conv c, ts_rng *r)
{
    problem p = make_problem(c, r);
    float *x = rounded(p.x, in_count(&c)), *dy = rounded(p.dy, out_count(&c)),
          *weight = rounded(p.weight, weight_count(&c));
    for (int b = 0; b < 2; b++) {
        float *y = run(&p, TS_CONV_FORWARD_BF16, b ? p.bias : NULL, NULL), *naive = values(out_count(&c), NULL);
        ts_conv_forward_naive(&c, &(ts_conv_inputs){.x = x, .bias = b ? p.bias : NULL}, weight, p.leak, naive);
        same(y, naive, out_count(&c), (double)c.ic * c.k * c.k, "forward", &c);
        free(y), free(naive);
        problem q = p;
        q.c.constants = b ? c.ic / 2 : 0; /* of a single channel none */
        const size_t count = variable_count(&q.c);
        float *dx = run(&q, TS_CONV_DATA_GRADIENT_BF16, NULL, b ? p.x : NULL), *naive_dx = values(count, NULL);
        memcpy(naive_dx, p.x, count * sizeof(float));
        ts_conv_data_gradient_naive(&q.c, dy, weight, naive_dx, b);
        same(dx, naive_dx, count, (double)c.oc * pow(c.k, 4), b ? "added data gradient" : "data gradient", &c);
        free(dx), free(naive_dx);
    }
    float *dweight = gradient_of_weights(&p), *naive = values(weight_count(&c), NULL);
    memcpy(naive, p.weight, weight_count(&c) * sizeof(float));
    ts_conv_weight_gradient_naive(&c, x, dy, naive, NULL);
    same(dweight, naive, weight_count(&c), (double)c.n * c.h * c.w, "weight gradient", &c);
    free(dweight), free(naive);
    free(x), free(dy), free(weight);
    finish(&p);
}

/* Of few inputs a band has many rows, and more steps than one of the largest block. */
TEST(bf16_weight_gradient_of_few_inputs)
{
    ts_rng r = ts_rng_make(27, TS_STREAM_TEST, 0);
    problem p = make_problem((ts_conv){1, 256, 256, 16, 15, 3, 1, TS_PAD_REPLICATE, 0, {0}}, &r);
    float *x = rounded(p.x, in_count(&p.c)), *dy = rounded(p.dy, out_count(&p.c));
    float *dweight = gradient_of_weights(&p), *naive = values(weight_count(&p.c), NULL);
    memcpy(naive, p.weight, weight_count(&p.c) * sizeof(float));
    ts_conv_weight_gradient_naive(&p.c, x, dy, naive, NULL);
    same(dweight, naive, weight_count(&p.c), (double)p.c.h * p.c.w, "weight gradient", &p.c);
    free(x), free(dy), free(dweight), free(naive);
    finish(&p);
}

TEST(bf16_conv_naive)
{
    static const ts_conv shapes[] = {
        {1, 1, 1, 1, 1, 15, 2, TS_PAD_REPLICATE, 0, {0}},    {1, 300, 1, 9, 3, 5, 2, TS_PAD_REPLICATE, 0, {0}},
        {1, 3, 211, 2, 33, 5, 1, TS_PAD_ZERO, 0, {0}},       {4, 2, 2, 512, 40, 3, 1, TS_PAD_ZERO, 0, {0}},
        {1, 2, 3, 1024, 33, 3, 1, TS_PAD_REPLICATE, 0, {0}}, {1, 9, 7, 5, 700, 7, 1, TS_PAD_REPLICATE, 0, {0}},
        {1, 40, 40, 18, 33, 1, 1, TS_PAD_ZERO, 0, {0}},      {17, 2, 2, 33, 65, 5, 1, TS_PAD_ZERO, 0, {0}},
        {2, 20, 70, 24, 10, 5, 2, TS_PAD_REPLICATE, 0, {0}},
    };
    ts_rng r = ts_rng_make(22, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 120; i++) against_naive(any_conv(&r, 1e6), &r);
        for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) against_naive(shapes[i], &r);
    }
}

TEST(bf16_conv_same_bytes_for_any_threads)
{
    static const ts_conv shapes[] = {
        {3, 37, 41, 18, 40, 5, 1, TS_PAD_REPLICATE, 0, {0}}, {1, 8, 8, 96, 130, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 4, 4, 47, 66, 5, 1, TS_PAD_ZERO, 0, {0}},        {2, 64, 50, 20, 9, 3, 2, TS_PAD_REPLICATE, 0, {0}},
        {2, 30, 31, 33, 70, 1, 1, TS_PAD_ZERO, 0, {0}},      {1, 6, 5, 700, 33, 7, 1, TS_PAD_REPLICATE, 0, {0}}};
    static const int threads[] = {1, 2, 3, 7};
    ts_rng r = ts_rng_make(23, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
            problem p = make_problem(shapes[i], &r);
            float *y = NULL, *dx = NULL, *dweight = NULL;
            for (int t = 0; t < 4; t++) {
                ts_threads_set(threads[t]);
                float *y_now = run(&p, TS_CONV_FORWARD_BF16, p.bias, NULL),
                      *dx_now = run(&p, TS_CONV_DATA_GRADIENT_BF16, NULL, NULL);
                float *dweight_now = gradient_of_weights(&p);
                CHECK(!y ||
                          (!memcmp(y, y_now, out_count(&p.c) * sizeof(float)) &&
                           !memcmp(dx, dx_now, in_count(&p.c) * sizeof(float))),
                      "%s: shape %zu: other bytes with %d threads", ts_isa_name((ts_isa)isa), i, threads[t]);
                CHECK(!dweight || !memcmp(dweight, dweight_now, weight_count(&p.c) * sizeof(float)),
                      "%s: shape %zu: another gradient of weights with %d threads", ts_isa_name((ts_isa)isa), i,
                      threads[t]);
                free(y), free(dx), free(dweight);
                y = y_now, dx = dx_now, dweight = dweight_now;
            }
            free(y), free(dx), free(dweight);
            finish(&p);
        }
    }
}

/* The new state is a mean of the old one, which no product rounds, and of what the rounded products give. */
TEST(bf16_gru_naive)
{
    ts_rng r = ts_rng_make(24, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int t = 0; t < 40; t++) {
            const ts_gru g = {1 + ts_rng_int(&r, 300), 1 + ts_rng_int(&r, 40), 1 + ts_rng_int(&r, 40), true, 0};
            const ts_conv in = ts_gru_input(&g), hidden = ts_gru_hidden(&g);
            const size_t pixels = (size_t)g.pixels, c = (size_t)g.c, ic = (size_t)g.ic;
            float *x = values(pixels * ic, &r), *any = values(pixels * c, &r), *ih = values(weight_count(&in), &r),
                  *hh = values(weight_count(&hidden), &r);
            float *ih_bias = values(3 * c, &r), *hh_bias = values(3 * c, &r), *y = values(pixels * c, NULL),
                  *naive = values(pixels * c, NULL);
            float *ih_packed = values(ts_conv_packed_count(&in, TS_CONV_FORWARD_BF16), NULL),
                  *hh_packed = values(ts_conv_packed_count(&hidden, TS_CONV_FORWARD_BF16), NULL);
            float *old = rounded(any, pixels * c), *x_rounded = rounded(x, pixels * ic),
                  *ih_rounded = rounded(ih, weight_count(&in)), *hh_rounded = rounded(hh, weight_count(&hidden));
            ts_conv_pack(&in, TS_CONV_FORWARD_BF16, ih, ih_packed);
            ts_conv_pack(&hidden, TS_CONV_FORWARD_BF16, hh, hh_packed);
            const bool state = ts_rng_int(&r, 4);
            ts_gru_forward(&g, x, state ? old : NULL, ih_packed, ih_bias, hh_packed, hh_bias, y, NULL);
            ts_gru_forward_naive(&g, x_rounded, state ? old : NULL, ih_rounded, ih_bias, hh_rounded, hh_bias, naive,
                                 NULL);
            same(y, naive, pixels * c, (double)(g.ic + g.c), "gru", &in);
            float *const all[] = {x,     any,       ih,        hh,  ih_bias,   hh_bias,    y,
                                  naive, ih_packed, hh_packed, old, x_rounded, ih_rounded, hh_rounded};
            for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
        }
    }
}

/* y, dx and dweight of one convolution on a tape, the loss being the mean over the pixels of the sum over the channels
 * of y. */
static void on_tape(ts_precision precision, const problem *p, float *y, float *dx, float *dweight)
{
    const ts_conv *c = &p->c;
    ts_status st = {0};
    float ones[64];
    for (int i = 0; i < 64; i++) ones[i] = 1;
    ag_tape *tape = ag_tape_create(true, &st);
    CHECK(tape, "%s", st.message);
    ag_compute_set(tape, (ts_compute){.exact = true, .precision = precision});
    memset(dx, 0, in_count(c) * sizeof(float));
    memset(dweight, 0, weight_count(c) * sizeof(float));
    ag_value *x = ag_parameter(tape, ts_view(p->x, (ts_shape){c->n, c->h, c->w, c->ic}), dx);
    ag_value *weight = ag_parameter(tape, ts_view(p->weight, (ts_shape){c->oc, c->ic, c->k, c->k}), dweight);
    ag_value *out = ag_conv(tape, x, weight, NULL, c->dilation, c->pad, 1);
    ag_value *sum = ag_conv(tape, ag_channel_mean(tape, out),
                            ag_constant(tape, ts_view(ones, (ts_shape){1, c->oc, 1, 1})), NULL, 1, TS_PAD_ZERO, 1);
    CHECK(ag_backward(tape, sum) == TS_OK, "%s", ag_status(tape)->message);
    memcpy(y, out->t.data, out_count(c) * sizeof(float));
    ag_tape_destroy(&tape);
}

/* Forward and the data gradient follow the choice. The weight gradient's operands are rounded where the CPU
 * multiplies bf16, and its bytes are f32's elsewhere. */
TEST(bf16_in_ag_conv)
{
    ts_rng r = ts_rng_make(25, TS_STREAM_TEST, 0);
    problem p = make_problem((ts_conv){1, 16, 32, 20, 33, 3, 2, TS_PAD_REPLICATE, 0, {0}}, &r);
    const ts_conv *c = &p.c;
    float *y[3], *dx[3], *dweight[3];
    for (int i = 0; i < 3; i++) {
        y[i] = values(out_count(c), NULL), dx[i] = values(in_count(c), NULL),
        dweight[i] = values(weight_count(c), NULL);
        if (i < 2) on_tape(i ? TS_BF16 : TS_F32, &p, y[i], dx[i], dweight[i]);
    }
    float *x = rounded(p.x, in_count(c)), *weight = rounded(p.weight, weight_count(c));
    ts_conv_forward_naive(c, &(ts_conv_inputs){.x = x}, weight, 1, y[2]);
    same(y[1], y[2], out_count(c), 9. * c->ic, "forward", c);
    for (size_t i = 0; i < out_count(c); i++) p.dy[i] = 1 / 512.f; /* a bf16 value as it is */
    ts_conv_data_gradient_naive(c, p.dy, weight, dx[2], false);
    same(dx[1], dx[2], in_count(c), 9. * c->oc / 512, "data gradient", c);
    CHECK(memcmp(y[0], y[1], out_count(c) * sizeof(float)) && memcmp(dx[0], dx[1], in_count(c) * sizeof(float)),
          "bf16 gives what f32 gives");
    ts_conv chosen = *c;
    chosen.compute = (ts_compute){.exact = true, .precision = TS_BF16}; /* as on_tape */
    if (ts_conv_rounds_weights(&chosen)) {
        memset(dweight[2], 0, weight_count(c) * sizeof(float));
        ts_conv_weight_gradient_naive(c, x, p.dy, dweight[2], NULL);
        same(dweight[1], dweight[2], weight_count(c), (double)c->h * c->w / 512, "weight gradient", c);
    } else CHECK(!memcmp(dweight[0], dweight[1], weight_count(c) * sizeof(float)), "the weight gradient is not f32's");
    for (int i = 0; i < 3; i++) free(y[i]), free(dx[i]), free(dweight[i]);
    free(x), free(weight);
    finish(&p);
}
