/* The kernels between the convolutions against their naive twins, on every instruction set; vmath against the C library
 * in double. */
#include "tensor/cpu.h"
#include "tensor/kernels/adam.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/kernels/norm.h"
#include "tensor/kernels/pool.h"
#include "tensor/kernels/resample.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 1 << 14, GUARD = 32 };

/* Two copies of each array: one for the kernel, one for its twin, with a guard behind the values. */
static float a0[ROOM], b0[ROOM], c0[ROOM], d0[ROOM], out1[ROOM], out2[ROOM], more1[ROOM], more2[ROOM], last1[ROOM],
    last2[ROOM];
static double sum1[ROOM], sum2[ROOM];
static ts_rng r;

/* From a random place of one table, since making every value anew would be most of the test's time. */
static void fill(float *x)
{
    static float table[2 * ROOM];
    if (table[1] == 0) {
        for (int i = 0; i < 2 * ROOM; i++) table[i] = i % 29 == 3 ? (i % 2 ? 0.0f : -0.0f) : ts_rng_range(&r, -3, 3);
    }
    memcpy(x, table + ts_rng_int(&r, ROOM), ROOM * sizeof *x);
}

static void fill_all(void)
{
    fill(a0);
    fill(b0);
    fill(c0);
    fill(d0);
    fill(out1);
    fill(more1);
    fill(last1);
    memcpy(out2, out1, sizeof out1);
    memcpy(more2, more1, sizeof out1);
    memcpy(last2, last1, sizeof out1);
    for (int i = 0; i < ROOM; i++) sum1[i] = sum2[i] = a0[i];
}

static void same(const char *what, const float *x, const float *want, int64_t n, double tolerance)
{
    for (int64_t i = 0; i < n + GUARD; i++) {
        bool ok = i < n ? fabs((double)x[i] - want[i]) <= tolerance * (1 + fabs(want[i]))
                        : memcmp(x + i, want + i, sizeof *x) == 0;
        CHECK(ok || (isnan(x[i]) && isnan(want[i])), "%s on %s: value %lld of %lld is %.9g, not %.9g", what,
              ts_isa_name(ts_isa_now()), (long long)i, (long long)n, (double)x[i], (double)want[i]);
    }
}

static void same_sums(const char *what, int64_t n, double tolerance)
{
    for (int64_t i = 0; i < n + GUARD; i++)
        CHECK(i < n ? fabs(sum1[i] - sum2[i]) <= tolerance * (1 + fabs(sum2[i])) : sum1[i] == sum2[i],
              "%s on %s: sum %lld is %.9g, not %.9g", what, ts_isa_name(ts_isa_now()), (long long)i, sum1[i], sum2[i]);
}

#define EVERY_ISA     \
    for (int isa = 0; \
         isa <= (int)ts_isa_best() && (ts_isa_use((ts_isa)isa), r = ts_rng_make(1, TS_STREAM_TEST, 0), true); isa++)

TEST(elementwise_twins)
{
    const struct ts_elementwise_kernels *n = &ts_elementwise_naive;
    EVERY_ISA
    {
        const struct ts_elementwise_kernels *k = ts_elementwise_k();
        for (int size = 1; size < 150; size += size < 70 ? 1 : 13) {
            const float leak = size % 3 ? 0.2f : size % 2 ? 1.0f : 0.0f;
            const bool add = size % 2;
#define TWICE(name, first, second) \
    fill_all();                    \
    k->first;                      \
    n->second;                     \
    same(name, out1, out2, size, 1e-6)
            TWICE("leaky", leaky(size, a0, leak, out1), leaky(size, a0, leak, out2));
            TWICE("leaky_backward", leaky_backward(size, a0, b0, leak, out1, add),
                  leaky_backward(size, a0, b0, leak, out2, add));
            TWICE("tanh", tanh(size, a0, out1), tanh(size, a0, out2));
            TWICE("tanh_backward", tanh_backward(size, a0, b0, out1, add), tanh_backward(size, a0, b0, out2, add));
            TWICE("selu", selu(size, a0, out1), selu(size, a0, out2));
            TWICE("selu_backward", selu_backward(size, a0, b0, out1, add), selu_backward(size, a0, b0, out2, add));
            TWICE("asinh", asinh(size, 10, a0, out1), asinh(size, 10, a0, out2));
            TWICE("small asinh", asinh(size, 1e-2f, a0, out1), asinh(size, 1e-2f, a0, out2));
            TWICE("large asinh", asinh(size, 1e25f, a0, out1), asinh(size, 1e25f, a0, out2));
            TWICE("add", add(size, a0, b0, out1), add(size, a0, b0, out2));
            TWICE("scale", scale(size, -1.7f, a0, out1, add), scale(size, -1.7f, a0, out2, add));
#undef TWICE
        }
    }
}

/* Every value there is, in one run and in short ones, at odd addresses. */
TEST(elementwise_from_half_is_exact)
{
    enum { ALL = 1 << 16, SHORT = 37 };
    static unsigned char bytes[1 + 2 * ALL], *half = bytes + 1;
    static float expected[ALL], got[ALL];
    for (int i = 0; i < ALL; i++) memcpy(half + 2 * i, &(uint16_t){(uint16_t)i}, 2);
    ts_elementwise_naive.from_half(ALL, half, expected);
    EVERY_ISA for (int run = SHORT; run <= ALL; run += ALL - SHORT)
    {
        for (int i = 0; i < ALL; i += run)
            ts_elementwise_k()->from_half(ALL - i < run ? ALL - i : run, half + 2 * i, got + i);
        for (int i = 0; i < ALL; i++)
            CHECK(isnan(expected[i]) ? isnan(got[i]) && !signbit(got[i]) == !(i & 0x8000)
                                     : !memcmp(&got[i], &expected[i], sizeof got[i]),
                  "%04x on %s: %g, not %g", i, ts_isa_name(ts_isa_now()), (double)got[i], (double)expected[i]);
    }
}

/* Rows that begin at odd addresses, of lengths around those that vectors and parts end at. */
TEST(elementwise_dots)
{
    enum { ROWS = 3, MOST = 600 };
    static unsigned char bytes[1 + 2 * ROWS * MOST], *half = bytes + 1;
    static float x[MOST], full[ROWS * MOST];
    EVERY_ISA for (int n = 1; n <= MOST; n += n < 70 ? 1 : 53)
    {
        float got[ROWS], same[ROWS], expected[ROWS], size[ROWS] = {0};
        for (int i = 0; i < n; i++) x[i] = (float)ts_rng_range(&r, -1, 1);
        for (int i = 0; i < ROWS * n; i++) {
            const uint16_t v = (uint16_t)(ts_rng_int(&r, 0x4000) | (ts_rng_int(&r, 2) ? 0x8000 : 0)); /* below 2 */
            memcpy(half + 2 * i, &v, 2);
            size[i / n] += 2 * fabsf(x[i % n]);
        }
        for (int k = 0; k < ROWS; k++) got[k] = same[k] = expected[k] = (float)k;
        ts_elementwise_naive.from_half(ROWS * n, half, full);
        ts_elementwise_k()->add_dots_half(ROWS, n, half, x, got);
        ts_elementwise_k()->add_dots(ROWS, n, full, x, same);
        ts_elementwise_naive.add_dots_half(ROWS, n, half, x, expected);
        CHECK(!memcmp(got, same, sizeof got), "%d numbers on %s: other bytes than of floats", n,
              ts_isa_name(ts_isa_now()));
        for (int k = 0; k < ROWS; k++)
            CHECK(fabsf(got[k] - expected[k]) <= 3e-7f * (1 + (float)k + size[k]), "%d numbers on %s: %g, not %g", n,
                  ts_isa_name(ts_isa_now()), (double)got[k], (double)expected[k]);
    }
}

TEST(elementwise_pixel_twins)
{
    const struct ts_elementwise_kernels *n = &ts_elementwise_naive;
    EVERY_ISA
    {
        const struct ts_elementwise_kernels *k = ts_elementwise_k();
        for (int t = 0; t < 60; t++) {
            const int c = t < 20 ? t + 1 : 1 + ts_rng_int(&r, 70),
                      pixels = t == 3 ? 1
                : t % 7               ? 1 + ts_rng_int(&r, 5)
                                      : 60 + ts_rng_int(&r, 11);
            const int size = c * pixels;
            const float leak = t % 3 ? 0.2f : 1.0f;
            const bool add = t % 2;
            if (4 * size + GUARD > ROOM) continue;
            fill_all();
            k->add_leaky(pixels, c, a0, b0, leak, out1);
            n->add_leaky(pixels, c, a0, b0, leak, out2);
            same("add_leaky", out1, out2, size, 1e-6);
            fill_all();
            k->add_leaky_backward(pixels, c, a0, b0, leak, t % 5 ? out1 : NULL, add, t % 4 ? sum1 : NULL);
            n->add_leaky_backward(pixels, c, a0, b0, leak, t % 5 ? out2 : NULL, add, t % 4 ? sum2 : NULL);
            same("add_leaky_backward", out1, out2, size, 1e-6);
            same_sums("add_leaky_backward", c, 1e-5);
            fill_all();
            k->broadcast(pixels, c, a0, out1, add);
            n->broadcast(pixels, c, a0, out2, add);
            same("broadcast", out1, out2, size, 1e-6);
            fill_all();
            k->copy(pixels, c, a0, c + 3, out1, c + 2, add);
            n->copy(pixels, c, a0, c + 3, out2, c + 2, add);
            same("copy", out1, out2, size + 2 * pixels, 1e-6);
            for (int one = 0; one < 2; one++) {
                const int64_t stride = one ? 0 : 3 * c;
                const float *old = t % 3 ? c0 : NULL;
                fill_all();
                k->gru(pixels, c, a0, b0, stride, old, out1, add ? more1 : NULL);
                n->gru(pixels, c, a0, b0, stride, old, out2, add ? more2 : NULL);
                same("gru", out1, out2, size, 2e-6);
                same("gru's gates", more1, more2, 4 * size, 2e-6);
                fill_all();
                for (int i = 0; i < ROOM; i++) d0[i] = 0.5f + 0.15f * d0[i]; /* gates */
                k->gru_backward(pixels, c, d0, old, a0, out1, t % 5 ? last1 : NULL, add, one ? sum1 : NULL);
                n->gru_backward(pixels, c, d0, old, a0, out2, t % 5 ? last2 : NULL, add, one ? sum2 : NULL);
                same("gru_backward", out1, out2, 4 * size, 3e-6);
                same("gru_backward dold", last1, last2, size, 3e-6);
                same_sums("gru_backward", 4 * c, 1e-5);
            }
        }
    }
}

TEST(norm_twins)
{
    const struct ts_norm_kernels *n = &ts_norm_naive;
    EVERY_ISA
    {
        const struct ts_norm_kernels *k = ts_norm_k();
        for (int t = 0; t < 60; t++) {
            const int c = t < 20 ? t + 1 : 1 + ts_rng_int(&r, 70),
                      pixels = t == 3 ? 1 : 1 + ts_rng_int(&r, t % 4 ? 9 : 200), size = c * pixels;
            const bool add = t % 2;
            if (size + GUARD > ROOM) continue;
            fill_all();
            k->sums(pixels, c, a0, sum1);
            n->sums(pixels, c, a0, sum2);
            same_sums("sums", c, 1e-5);
            fill_all();
            if (t % 3 == 0)
                for (int i = 0; i < ROOM; i++)
                    a0[i] += 5000.0f; /* far from zero, where one pass of squares would fail */
            k->moments(pixels, c, a0, sum1, sum1 + 1000);
            n->moments(pixels, c, a0, sum2, sum2 + 1000);
            same_sums("moments", 1000 + c, 1e-5);
            fill_all();
            k->normalise(pixels, c, a0, b0, c0, d0, out1);
            n->normalise(pixels, c, a0, b0, c0, d0, out2);
            same("normalise", out1, out2, size, 3e-6);
            fill_all();
            k->gradient_sums(pixels, c, a0, b0, sum1, sum1 + 1000);
            n->gradient_sums(pixels, c, a0, b0, sum2, sum2 + 1000);
            same_sums("gradient_sums", 1000 + c, 1e-5);
            fill_all();
            k->gradient(pixels, c, a0, b0, c0, d0, a0 + 1000, out1, add);
            n->gradient(pixels, c, a0, b0, c0, d0, a0 + 1000, out2, add);
            same("gradient", out1, out2, size, 1e-5);
        }
    }
}

TEST(norm_sums_of_many_pixels)
{
    /* 4096^2 values of 0.1: a float sum would be off by percents. Through sums in pieces, as the op does it, piece
     * repeated. */
    EVERY_ISA
    {
        for (int i = 0; i < ROOM; i++) a0[i] = 0.1f;
        double sum = 0;
        for (int i = 0; i < 4096 * 4096 / ROOM; i++) ts_norm_k()->sums(ROOM, 1, a0, &sum);
        const double want = 4096.0 * 4096.0 * 0.1f;
        CHECK(fabs(sum - want) <= 1e-6 * want, "the sum is %.9g, not %.9g", sum, want);
    }
}

TEST(pool_twins)
{
    EVERY_ISA
    {
        for (int t = 0; t < 60; t++) {
            const int c = t < 20 ? t + 1 : 1 + ts_rng_int(&r, 70), w = 1 + ts_rng_int(&r, 9), size = c * w;
            fill_all();
            if (t % 3 == 0)
                for (int i = 0; i < ROOM; i++) a0[i] = (float)(int)a0[i], b0[i] = (float)(int)b0[i]; /* equal values */
            if (t % 5 == 0) a0[ts_rng_int(&r, 2 * size)] = NAN, b0[ts_rng_int(&r, 2 * size)] = NAN;
            ts_pool_k()->max(w, c, a0, b0, out1);
            ts_pool_naive.max(w, c, a0, b0, out2);
            same("max", out1, out2, size, 0);
            fill_all();
            ts_pool_k()->max_backward(w, c, a0, b0, c0, more1, last1, t % 2);
            ts_pool_naive.max_backward(w, c, a0, b0, c0, more2, last2, t % 2);
            same("max_backward row 0", more1, more2, 2 * size, 0);
            same("max_backward row 1", last1, last2, 2 * size, 0);
        }
    }
}

TEST(resample_twins)
{
    EVERY_ISA
    {
        for (int t = 0; t < 60; t++) {
            const int n = 1 + ts_rng_int(&r, 300), count = 1 + ts_rng_int(&r, 6), c = 1 + ts_rng_int(&r, 40),
                      w = 1 + ts_rng_int(&r, 9);
            int first[16], offset[17] = {0};
            fill_all();
            ts_resample_k()->rows(n, count, b0, a0, n + 3, out1);
            ts_resample_naive.rows(n, count, b0, a0, n + 3, out2);
            same("rows", out1, out2, n, 1e-5);
            for (int j = 0; j < w; j++) {
                first[j] = ts_rng_int(&r, 9);
                offset[j + 1] = offset[j] + ts_rng_int(&r, 5);
            }
            ts_resample_k()->pixels(w, c, first, offset, b0, a0, more1, t % 2);
            ts_resample_naive.pixels(w, c, first, offset, b0, a0, more2, t % 2);
            same("pixels", more1, more2, w * c, 1e-5);
        }
    }
}

TEST(adam_twins)
{
    EVERY_ISA
    {
        for (int n = 1; n < 200; n += n < 70 ? 1 : 17) {
            fill_all();
            for (int i = 0; i < ROOM; i++) last1[i] = last2[i] = fabsf(last1[i]); /* second moments */
            ts_adam_k()->step((size_t)n, out1, a0, more1, last1, 0.9f, 0.999f, 1e-3f, 1e-8f, 0.7f);
            ts_adam_naive.step((size_t)n, out2, a0, more2, last2, 0.9f, 0.999f, 1e-3f, 1e-8f, 0.7f);
            same("step p", out1, out2, n, 1e-6);
            same("step m", more1, more2, n, 1e-6);
            same("step v", last1, last2, n, 1e-6);
            ts_adam_k()->average((size_t)n, out1, b0, 0.99f);
            ts_adam_naive.average((size_t)n, out2, b0, 0.99f);
            same("average", out1, out2, n, 1e-6);
            const double s1 = ts_adam_k()->sum_of_squares((size_t)n, a0),
                         s2 = ts_adam_naive.sum_of_squares((size_t)n, a0);
            CHECK(fabs(s1 - s2) <= 1e-13 * s2, "sum_of_squares: %.17g, not %.17g", s1, s2);
        }
        a0[5] = NAN;
        CHECK(isnan(ts_adam_k()->sum_of_squares(70, a0)), "sum_of_squares hides a NaN");
        a0[5] = 3e38f;
        CHECK(isfinite(ts_adam_k()->sum_of_squares(70, a0)), "sum_of_squares overflows where a double does not");
    }
}

static double sigmoid(double x) { return x < 0 ? exp(x) / (1 + exp(x)) : 1 / (1 + exp(-x)); }

static double gamma_encode(double x) { return x > 0 ? x < 1 ? pow(x, 1 / 2.2) : 1 : 0; }

/* |got - want| in units in the last place of want as a float. */
static double ulps(float got, double want)
{
    if (isnan(got) || isnan(want)) return isnan(got) && isnan(want) ? 0 : INFINITY;
    if (isinf(got) || isinf((float)want)) {
        /* at the very end of the range either side is right to a rounding */
        bool edge = fabs(want) > 3.4028233e38 && fabsf(got) > 3.4028233e38f && (got > 0) == (want > 0);
        return got == (float)want ? 0 : edge ? 1 : INFINITY;
    }
    int e;
    frexp(want, &e);
    return fabs(got - want) / ldexp(1, e - 24 < -149 ? -149 : e - 24);
}

TEST(vmath_errors)
{
    enum { N = 1 << 12 };
    EVERY_ISA
    {
        const struct ts_vmath_arrays_kernels *k = ts_vmath_arrays_k();
        const struct {
            const char *name;
            void (*f)(int64_t, const float *, float *);
            double (*want)(double);
            double bound;
        } f[] = {
            {"exp", k->exp, exp, 2},
            {"exp2", k->exp2, exp2, 2},
            {"expm1", k->expm1, expm1, 2},
            {"log", k->log, log, 2},
            {"tanh", k->tanh, tanh, 3},
            {"sigmoid", k->sigmoid, sigmoid, 3},
            {"gamma", k->gamma, gamma_encode, 80},
        };
        const float special[] = {0.0f,       -0.0f,         INFINITY,       -INFINITY,      NAN,
                                 1.0f,       -1.0f,         0x1p-149f,      -0x1p-149f,     0x1p-126f,
                                 -0x1p-127f, 3.4028235e38f, -3.4028235e38f, 88.72283f,      88.72284f,
                                 -87.33655f, -103.97f,      -103.98f,       127.99999f,     128.0f,
                                 -126.0f,    -149.0f,       -150.1f,        0x1.fffffep-1f, 0x1.000002p0f};
        for (int q = 0; q < 7; q++) {
            double worst = 0;
            float at = 0;
            /* every exponent and both signs: bits in steps of 16411, plus a dense sample of [-110, 135] */
            for (uint64_t start = 0, dense = 0; start < ((uint64_t)1 << 32) || dense < 40; dense += start >> 32) {
                int n = 0;
                for (; n < N && start < ((uint64_t)1 << 32); n++, start += 16411) {
                    uint32_t bits = (uint32_t)start;
                    memcpy(a0 + n, &bits, sizeof bits);
                }
                for (; n < N; n++) a0[n] = ts_rng_range(&r, -110, 135);
                memcpy(a0, special, sizeof special);
                f[q].f(N, a0, out1);
                for (int i = 0; i < N; i++) {
                    double e = ulps(out1[i], f[q].want(a0[i]));
                    if (e > worst) worst = e, at = a0[i];
                }
            }
            CHECK(worst <= f[q].bound, "%s on %s: %.2f ulp at %a", f[q].name, ts_isa_name((ts_isa)isa), worst,
                  (double)at);
        }
        /* signs of zeros */
        float zero[2] = {-0.0f, 0.0f}, y[2];
        k->tanh(2, zero, y);
        CHECK(signbit(y[0]) && !signbit(y[1]), "tanh loses the sign of zero");
        k->expm1(2, zero, y);
        CHECK(signbit(y[0]) && !signbit(y[1]), "expm1 loses the sign of zero");
    }
}
