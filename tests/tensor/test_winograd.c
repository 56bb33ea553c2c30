#include "autograd/tape.h"
#include "ops.h"
#include "tensor/conv/conv.h"
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
static size_t count_w(const ts_conv *c) { return (size_t)(c->k * c->k) * (size_t)c->ic * (size_t)c->oc; }
static size_t count_x(const ts_conv *c) { return (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->ic; }

/* Whether c->compute asks for products of bf16. */
static bool rounded(const ts_conv *c) { return c->compute.precision == TS_BF16; }

static float *run(const ts_conv *c, const float *x, const float *weight, const float *bias, float leak)
{
    enum { GUARD = 64 };
    const ts_conv_use use = rounded(c) ? TS_CONV_WINOGRAD_BF16 : TS_CONV_WINOGRAD;
    float *packed = values(ts_conv_packed_count(c, use), NULL), *y = values(count_y(c) + 2 * GUARD, NULL);
    ts_conv_pack(c, use, weight, packed);
    (rounded(c) ? ts_conv_forward_winograd_bf16 : ts_conv_forward_winograd)(c, &(ts_conv_inputs){.x = x, .bias = bias},
                                                                            packed, leak, y + GUARD);
    for (int i = 0; i < GUARD; i++)
        CHECK(isnan(y[i]) && isnan(y[GUARD + count_y(c) + (size_t)i]), "written %d floats outside y", i);
    memmove(y, y + GUARD, count_y(c) * sizeof(float));
    free(packed);
    return y;
}

/* Relative to the largest, a sum of count products of values in [-1, 1]; and over all. What bf16 rounds is as random as
 * its operands: errors grow with the root. */
static void close_to(const float *a, const float *naive, size_t n, double count, const char *what, const ts_conv *c)
{
    const double most = rounded(c) ? 0.04 * sqrt(4 + count) : 2e-6 * (4 + count);
    double error = 0, size = 0;
    for (size_t i = 0; i < n; i++) {
        CHECK(fabs((double)a[i] - naive[i]) <= most,
              "%s: %s, %s, side %d, n %d, %d x %d, %d to %d, %d constants, dilation %d, %s: value %zu is %.9g, naive "
              "%.9g",
              ts_isa_name(ts_isa_now()), what, rounded(c) ? "bf16" : "f32", c->k, c->n, c->h, c->w, c->ic, c->oc,
              c->constants, c->dilation, c->pad == TS_PAD_ZERO ? "zero" : "replicate", i, a[i], naive[i]);
        error += ((double)a[i] - naive[i]) * ((double)a[i] - naive[i]);
        size += (double)naive[i] * naive[i];
    }
    if (rounded(c)) CHECK(n < 256 || error <= 4e-4 * size, "%s: relative error %.3g", what, sqrt(error / size));
    else CHECK(error <= 1e-10 * size, "%s: relative error %.3g", what, sqrt(error / size));
}

static void against_naive(ts_conv c, ts_rng *r)
{
    static const float leaks[] = {1, 0.2f, 0};
    const float leak = leaks[ts_rng_int(r, 3)];
    float *x = values(count_x(&c), r), *weight = values(count_w(&c), r), *bias = values((size_t)c.oc, r),
          *naive = values(count_y(&c), NULL);
    for (int b = 0; b < 2; b++) {
        float *y = run(&c, x, weight, b ? bias : NULL, leak);
        ts_conv_forward_naive(&c, &(ts_conv_inputs){.x = x, .bias = b ? bias : NULL}, weight, leak, naive);
        close_to(y, naive, count_y(&c), (double)c.k * c.k * c.ic, "forward", &c);
        free(y);
    }
    free(x), free(weight), free(bias), free(naive);
}

static float *data_gradient(const ts_conv *c, const float *dy, const float *weight, const float *start)
{
    enum { GUARD = 64 };
    const size_t count = count_x(c) / (size_t)c->ic * (size_t)ts_conv_variables(c);
    const ts_conv_use use = rounded(c) ? TS_CONV_DATA_GRADIENT_WINOGRAD_BF16 : TS_CONV_DATA_GRADIENT_WINOGRAD;
    float *packed = values(ts_conv_packed_count(c, use), NULL), *dx = values(count + 2 * GUARD, NULL);
    if (start) memcpy(dx + GUARD, start, count * sizeof(float));
    ts_conv_pack(c, use, weight, packed);
    (rounded(c) ? ts_conv_data_gradient_winograd_bf16 : ts_conv_data_gradient_winograd)(c, dy, packed, dx + GUARD,
                                                                                        start != NULL);
    for (int i = 0; i < GUARD; i++)
        CHECK(isnan(dx[i]) && isnan(dx[GUARD + count + (size_t)i]), "written %d floats outside dx", i);
    memmove(dx, dx + GUARD, count * sizeof(float));
    free(packed);
    return dx;
}

static void weight_gradient(const ts_conv *c, const float *x, const float *dy, float *dweight)
{
    (rounded(c) ? ts_conv_weight_gradient_winograd_bf16
                : ts_conv_weight_gradient_winograd)(c, &(ts_conv_inputs){.x = x}, dy, dweight);
}

static void gradients_against_naive(ts_conv c, ts_rng *r)
{
    const size_t weights = count_w(&c);
    float *x = values(count_x(&c), r), *weight = values(weights, r), *dy = values(count_y(&c), r),
          *naive = values(count_x(&c), NULL);
    for (int i = 0; i < 4; i++) {
        ts_conv now = c;
        now.constants = i / 2 ? c.ic / 2 : 0; /* of a single channel none */
        float *dx = data_gradient(&now, dy, weight, i % 2 ? x : NULL);
        memcpy(naive, x, count_x(&c) * sizeof(float));
        ts_conv_data_gradient_naive(&now, dy, weight, naive, i % 2);
        close_to(dx, naive, count_x(&c) / (size_t)c.ic * (size_t)ts_conv_variables(&now), pow(c.k, 4) * c.oc,
                 i % 2 ? "added data gradient" : "data gradient", &now);
        free(dx);
    }
    if (c.k == 3) { /* of side 5 there is none */
        float *dweight = values(weights, NULL), *expected = values(weights, NULL);
        memcpy(dweight, weight, weights * sizeof(float)); /* added to what is there */
        memcpy(expected, weight, weights * sizeof(float));
        weight_gradient(&c, x, dy, dweight);
        ts_conv_weight_gradient_naive(&c, x, dy, expected, NULL);
        close_to(dweight, expected, weights, (double)c.n * c.h * c.w, "weight gradient", &c);
        free(dweight), free(expected);
    }
    free(x), free(weight), free(dy), free(naive);
}

static void over_shapes(void (*check)(ts_conv c, ts_rng *r), ts_precision precision, uint64_t seed)
{
    const ts_compute compute = {.precision = precision};
    static const int channels[] = {1, 3, 15, 16, 17, 20, 33, 40}, sizes[] = {1, 2, 3, 4, 5, 7, 9, 12, 13, 18, 23};
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < (precision == TS_F32 ? 120 : 40); i++)
            check((ts_conv){1 + ts_rng_int(&r, 2), sizes[ts_rng_int(&r, 11)], sizes[ts_rng_int(&r, 11)],
                            channels[ts_rng_int(&r, 8)], channels[ts_rng_int(&r, 8)],
                            precision == TS_F32 && i % 3 == 2 ? 5 : 3, 1 + ts_rng_int(&r, 2),
                            ts_rng_int(&r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE, 0, compute},
                  &r);
        check((ts_conv){1, 43, 29, 64, 64, 3, 1, TS_PAD_ZERO, 0, compute}, &r);
        check((ts_conv){1, 24, 37, 32, 70, 3, 2, TS_PAD_REPLICATE, 0, compute}, &r);
        if (precision == TS_F32) check((ts_conv){1, 43, 29, 18, 80, 5, 1, TS_PAD_REPLICATE, 0, compute}, &r);
    }
}

TEST(winograd_naive) { over_shapes(against_naive, TS_F32, 11); }
TEST(winograd_gradients_naive) { over_shapes(gradients_against_naive, TS_F32, 14); }
TEST(winograd_bf16_naive) { over_shapes(against_naive, TS_BF16, 15); }
TEST(winograd_bf16_gradients_naive) { over_shapes(gradients_against_naive, TS_BF16, 16); }

static void same_bytes_for_any_threads(ts_precision precision)
{
    static const int threads[] = {1, 2, 3};
    const ts_conv c = {2, 37, 31, 33, 40, 3, 2, TS_PAD_REPLICATE, 0, {.precision = precision}};
    ts_rng r = ts_rng_make(12, TS_STREAM_TEST, 0);
    const size_t weights = count_w(&c), count[3] = {count_y(&c), count_x(&c), weights};
    float *x = values(count_x(&c), &r), *weight = values(weights, &r), *dy = values(count_y(&c), &r), *first[3] = {0};
    for (int t = 0; t < 3; t++) {
        ts_threads_set(threads[t]);
        float *dweight = calloc(weights, sizeof *dweight);
        weight_gradient(&c, x, dy, dweight);
        float *now[3] = {run(&c, x, weight, NULL, 1), data_gradient(&c, dy, weight, NULL), dweight};
        for (int i = 0; i < 3; i++) {
            CHECK(!first[i] || memcmp(first[i], now[i], count[i] * sizeof(float)) == 0,
                  "%d: other bytes with %d threads", i, threads[t]);
            if (first[i]) free(now[i]);
            else first[i] = now[i];
        }
    }
    for (int i = 0; i < 3; i++) free(first[i]);
    free(x), free(weight), free(dy);
}

TEST(winograd_same_bytes_for_any_threads) { same_bytes_for_any_threads(TS_F32); }
TEST(winograd_bf16_same_bytes_for_any_threads) { same_bytes_for_any_threads(TS_BF16); }

/* What bf16 costs where neighbours resemble each other, as in images: no more than by the direct way. */
TEST(winograd_bf16_of_smooth_inputs)
{
    const ts_conv c = {1, 48, 48, 32, 32, 3, 1, TS_PAD_REPLICATE, 0, {.precision = TS_BF16}};
    ts_rng r = ts_rng_make(17, TS_STREAM_TEST, 0);
    float *x = values(count_x(&c), NULL), *weight = values(count_w(&c), &r), *naive = values(count_y(&c), NULL),
          *direct = values(count_y(&c), NULL), *packed = values(ts_conv_packed_count(&c, TS_CONV_FORWARD_BF16), NULL);
    for (int ch = 0; ch < c.ic; ch++) {
        const double u = 0.3 * ts_rng_range(&r, -1, 1), v = 0.3 * ts_rng_range(&r, -1, 1), w = ts_rng_range(&r, -3, 3);
        for (int p = 0; p < c.h * c.w; p++)
            x[(size_t)p * (size_t)c.ic + (size_t)ch] = (float)sin(w + u * (p / c.w) + v * (p % c.w));
    }
    ts_conv_forward_naive(&c, &(ts_conv_inputs){.x = x}, weight, 1, naive);
    ts_conv_pack(&c, TS_CONV_FORWARD_BF16, weight, packed);
    ts_conv_forward_bf16(&c, &(ts_conv_inputs){.x = x}, packed, 1, direct);
    float *winograd = run(&c, x, weight, NULL, 1);
    double error[2] = {0}, size = 0;
    for (size_t i = 0; i < count_y(&c); i++) {
        error[0] += ((double)direct[i] - naive[i]) * ((double)direct[i] - naive[i]);
        error[1] += ((double)winograd[i] - naive[i]) * ((double)winograd[i] - naive[i]);
        size += (double)naive[i] * naive[i];
    }
    printf("  RMS of errors over that of results: direct %.5f, Winograd %.5f\n", sqrt(error[0] / size),
           sqrt(error[1] / size));
    CHECK(error[1] > 0 && error[1] <= 1.5 * 1.5 * error[0], "errors %.3g times the direct way's",
          sqrt(error[1] / error[0]));
    free(x), free(weight), free(naive), free(direct), free(packed), free(winograd);
}

/* ag_conv takes Winograd's way only when it was allowed; and its gradients do. */
TEST(winograd_in_ag_conv)
{
    enum { Y, DX, DWEIGHT, RESULTS };
    const ts_conv c = {1, 128, 68, 24, 32, 3, 1, TS_PAD_REPLICATE, 0, {0}};
    const size_t weights = count_w(&c), count[RESULTS] = {count_y(&c), count_x(&c), weights};
    static const char *const names[] = {"y", "dx", "dweight"};
    ts_rng r = ts_rng_make(13, TS_STREAM_TEST, 0);
    float *x = values(count_x(&c), &r), *weight = values(weights, &r), *mix = values((size_t)c.oc, &r),
          *result[3][RESULTS];
    for (int d = TS_CONV_OUTPUT; d <= TS_CONV_WEIGHTS; d++)
        CHECK(ts_conv_choose(&c, (ts_conv_direction)d) == TS_CONV_BY_WINOGRAD, "this shape should pay");
    for (int i = 0; i < 3; i++) {
        ts_status st = {0};
        ag_tape *tape = ag_tape_create(true, &st);
        CHECK(tape, "%s", st.message);
        CHECK(ag_compute(tape)->exact, "direct is not the default");
        ag_compute_set(tape, (ts_compute){.exact = i != 1});
        float *dx = calloc(count[DX], sizeof *dx), *dweight = calloc(weights, sizeof *dweight);
        ag_value *in = ag_parameter(tape, ts_view(x, (ts_shape){c.n, c.h, c.w, c.ic}), dx);
        ag_value *y = ag_conv(tape, in, ag_parameter(tape, ts_view(weight, (ts_shape){c.oc, c.ic, 3, 3}), dweight),
                              NULL, c.dilation, c.pad, 1);
        CHECK(y, "%s", ag_status(tape)->message);
        ag_value *loss = ag_linear(tape, ag_channel_mean(tape, ag_tanh(tape, y)),
                                   ag_constant(tape, ts_view(mix, (ts_shape){1, 1, 1, c.oc})), NULL);
        CHECK(ag_backward(tape, loss) == TS_OK, "%s", ag_status(tape)->message);
        result[i][Y] = values(count[Y], NULL), result[i][DX] = dx, result[i][DWEIGHT] = dweight;
        memcpy(result[i][Y], y->t.data, count[Y] * sizeof(float));
        ag_tape_destroy(&tape);
    }
    for (int k = 0; k < RESULTS; k++) {
        CHECK(memcmp(result[0][k], result[2][k], count[k] * sizeof(float)) == 0, "%s: direct again, but other bytes",
              names[k]);
        CHECK(memcmp(result[0][k], result[1][k], count[k] * sizeof(float)) != 0, "%s: allowed, but not used", names[k]);
        double size = 0, error = 0;
        for (size_t i = 0; i < count[k]; i++) {
            const double e = fabs((double)result[0][k][i] - result[1][k][i]), s = fabs((double)result[0][k][i]);
            error = farther(error, e), size = farther(size, s);
        }
        printf("  %s: largest difference over largest value %.2g\n", names[k], error / size);
        CHECK(isfinite(size) && error <= 1e-4 * size, "%s: %g off, the largest value is %g", names[k], error, size);
        for (int i = 0; i < 3; i++) free(result[i][k]);
    }
    free(x), free(weight), free(mix);
}
