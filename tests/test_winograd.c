#include "autograd/tape.h"
#include "ops.h"
#include "tensor/conv.h"
#include "tensor/cpu.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static float *values(size_t count, ts_rng *r)
{
    float *p = malloc(count * sizeof(float));
    CHECK(p, "no memory");
    for (size_t i = 0; i < count; i++) p[i] = r ? ts_rng_range(r, -1, 1) : NAN;
    return p;
}

static size_t count_y(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->oc; }
static size_t count_x(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->ic; }

static float *run(const ts_conv *c, const float *x, const float *weight, const float *bias, float leak)
{
    enum { GUARD = 64 };
    float *packed = values(ts_conv_packed_count(c, TS_CONV_WINOGRAD), NULL), *y = values(count_y(c) + 2 * GUARD, NULL);
    ts_conv_pack(c, TS_CONV_WINOGRAD, weight, packed);
    ts_conv_forward_winograd(c, x, packed, bias, leak, y + GUARD);
    for (int i = 0; i < GUARD; i++) CHECK(isnan(y[i]) && isnan(y[GUARD + count_y(c) + (size_t)i]), "written %d floats outside y", i);
    memmove(y, y + GUARD, count_y(c) * sizeof(float));
    free(packed);
    return y;
}

/* Errors relative to the sum of the sizes of all products, which is what rounding is in proportion to. */
static void against_naive(ts_conv c, ts_rng *r)
{
    static const float leaks[] = {1, 0.2f, 0};
    const float leak = leaks[ts_rng_int(r, 3)];
    float *x = values(count_x(&c), r), *weight = values((size_t)c.ic * (size_t)c.oc * 9, r), *bias = values((size_t)c.oc, r), *naive = values(count_y(&c), NULL);
    for (int b = 0; b < 2; b++) {
        float *y = run(&c, x, weight, b ? bias : NULL, leak);
        ts_conv_forward_naive(&c, x, weight, b ? bias : NULL, leak, naive);
        double error = 0, size = 0;
        for (size_t i = 0; i < count_y(&c); i++) {
            CHECK(fabs((double)y[i] - naive[i]) <= 2e-6 * (4 + 9.0 * c.ic), "%s: n %d, %d x %d, %d to %d, dilation %d, %s: value %zu is %.9g, naive %.9g",
                  ts_isa_name(ts_isa_now()), c.n, c.h, c.w, c.ic, c.oc, c.dilation, c.pad == TS_PAD_ZERO ? "zero" : "replicate", i, y[i], naive[i]);
            error += ((double)y[i] - naive[i]) * ((double)y[i] - naive[i]);
            size += (double)naive[i] * naive[i];
        }
        CHECK(error <= 1e-10 * size, "relative error %.3g", sqrt(error / size));
        free(y);
    }
    free(x), free(weight), free(bias), free(naive);
}

TEST(winograd_naive)
{
    static const int channels[] = {1, 3, 15, 16, 17, 20, 33, 40}, sizes[] = {1, 2, 3, 4, 5, 7, 9, 12, 13, 18, 23};
    ts_rng r = ts_rng_make(11, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 80; i++)
            against_naive((ts_conv){1 + ts_rng_int(&r, 2), sizes[ts_rng_int(&r, 11)], sizes[ts_rng_int(&r, 11)], channels[ts_rng_int(&r, 8)],
                                    channels[ts_rng_int(&r, 8)], 3, 1 + ts_rng_int(&r, 2), ts_rng_int(&r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE, 0}, &r);
        against_naive((ts_conv){1, 43, 29, 64, 64, 3, 1, TS_PAD_ZERO, 0}, &r);
        against_naive((ts_conv){1, 24, 37, 32, 70, 3, 2, TS_PAD_REPLICATE, 0}, &r);
    }
}

TEST(winograd_same_bytes_for_any_threads)
{
    static const int threads[] = {1, 2, 3};
    const ts_conv c = {2, 37, 31, 33, 40, 3, 2, TS_PAD_REPLICATE, 0};
    ts_rng r = ts_rng_make(12, TS_STREAM_TEST, 0);
    float *x = values(count_x(&c), &r), *weight = values((size_t)c.ic * (size_t)c.oc * 9, &r), *first = NULL;
    for (int t = 0; t < 3; t++) {
        ts_threads_set(threads[t]);
        float *y = run(&c, x, weight, NULL, 1);
        CHECK(!first || memcmp(first, y, count_y(&c) * sizeof(float)) == 0, "other bytes with %d threads", threads[t]);
        if (first) free(y);
        else first = y;
    }
    free(first), free(x), free(weight);
}

/* ag_conv takes Winograd's way only when it was allowed, and only for kernels of side 3. */
TEST(winograd_in_ag_conv)
{
    const ts_conv c = {1, 32, 40, 20, 32, 3, 1, TS_PAD_REPLICATE, 0};
    ts_rng r = ts_rng_make(13, TS_STREAM_TEST, 0);
    float *x = values(count_x(&c), &r), *weight = values((size_t)c.ic * (size_t)c.oc * 9, &r), *result[3];
    CHECK(ts_conv_exact(), "direct is not the default");
    CHECK(ts_conv_winograd(&c), "this shape should pay");
    for (int i = 0; i < 3; i++) {
        ts_status st = {0};
        ag_tape *tape = ag_tape_create(false, &st);
        CHECK(tape, "%s", st.message);
        ts_conv_exact_set(i != 1);
        ag_value *in = ag_constant(tape, ts_view(x, (ts_shape){c.n, c.h, c.w, c.ic}));
        ag_value *y = ag_conv(tape, in, ag_constant(tape, ts_view(weight, (ts_shape){c.oc, c.ic, 3, 3})),
                              NULL, c.dilation, c.pad, 0.2f);
        CHECK(y, "%s", ag_status(tape)->message);
        result[i] = values(count_y(&c), NULL);
        memcpy(result[i], y->t.data, count_y(&c) * sizeof(float));
        ag_tape_destroy(&tape);
    }
    CHECK(memcmp(result[0], result[2], count_y(&c) * sizeof(float)) == 0, "direct again, but other bytes");
    CHECK(memcmp(result[0], result[1], count_y(&c) * sizeof(float)) != 0, "allowed, but not used");
    for (size_t i = 0; i < count_y(&c); i++)
        CHECK(fabs((double)result[0][i] - result[1][i]) <= 4e-4, "value %zu: %.9g, direct %.9g", i, result[1][i], result[0][i]);
    for (int i = 0; i < 3; i++) free(result[i]);
    free(x), free(weight);
}
