#include "tensor/conv/gru.h"
#include "tensor/cpu.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { X, OLD, IH, IH_BIAS, HH, HH_BIAS, DY, ARRAYS };

typedef struct subject {
    ts_gru g;
    float *in[ARRAYS];
    size_t counts[ARRAYS], gradients;
} subject;

static float *values(size_t count, ts_rng *r)
{
    float *p = malloc((count + 1) * sizeof(float));
    CHECK(p, "no memory");
    for (size_t i = 0; i < count; i++) p[i] = r ? ts_rng_range(r, -1, 1) : NAN;
    return p;
}

static subject make(ts_gru g, uint64_t index)
{
    ts_rng r = ts_rng_make(31, TS_STREAM_TEST, index);
    const size_t p = (size_t)g.pixels, ic = (size_t)g.ic, c = (size_t)g.c,
                 counts[ARRAYS] = {p * ic, p * c, 3 * c * ic, 3 * c, 3 * c * c, 3 * c, p * c};
    subject s = {.g = g, .gradients = 3 * c * (ic + c + 2)};
    for (int i = 0; i < ARRAYS; i++) s.in[i] = values(counts[i], &r);
    memcpy(s.counts, counts, sizeof counts);
    return s;
}

static void discard(subject *s)
{
    for (int i = 0; i < ARRAYS; i++) free(s->in[i]);
}

typedef struct results {
    float *y, *saved, *dx, *dold, *weights;
    ts_gru_gradients to;
} results;

/* old: whether there is a state; add: gradients are added to ones */
static results room(const subject *s, bool old, bool add)
{
    const size_t p = (size_t)s->g.pixels, c = (size_t)s->g.c, ic = (size_t)s->g.ic;
    results r = {values(p * c, NULL), values(4 * p * c, NULL),    values(p * ic, NULL),
                 values(p * c, NULL), values(s->gradients, NULL), {0}};
    for (size_t i = 0; i < s->gradients; i++) r.weights[i] = 1;
    for (size_t i = 0; i < p * ic && add; i++) r.dx[i] = 1;
    for (size_t i = 0; i < p * c && add; i++) r.dold[i] = 1;
    r.to = (ts_gru_gradients){r.dx,
                              old ? r.dold : NULL,
                              add,
                              add,
                              r.weights,
                              r.weights + 3 * c * ic,
                              r.weights + 3 * c * (ic + 1),
                              r.weights + 3 * c * (ic + 1 + c)};
    return r;
}

static void empty(results *r) { free(r->y), free(r->saved), free(r->dx), free(r->dold), free(r->weights); }

static float *pack(ts_conv c, ts_conv_use use, const float *weight)
{
    float *p = values(ts_conv_packed_count(&c, use), NULL);
    ts_conv_pack(&c, use, weight, p);
    return p;
}

static results fast(const subject *s, bool old, bool add)
{
    results r = room(s, old, add);
    const float *state = old ? s->in[OLD] : NULL;
    const ts_conv_use forward = s->g.bf16 ? TS_CONV_FORWARD_BF16 : TS_CONV_FORWARD,
                      backward = ts_gru_backward_bf16(&s->g) ? TS_CONV_DATA_GRADIENT_BF16 : TS_CONV_DATA_GRADIENT;
    float *p[4];
    for (int i = 0; i < 4; i++)
        p[i] = pack(i % 2 ? ts_gru_hidden(&s->g) : ts_gru_input(&s->g), i < 2 ? forward : backward,
                    s->in[i % 2 ? HH : IH]);
    ts_gru_forward(&s->g, s->in[X], state, p[0], s->in[IH_BIAS], p[1], s->in[HH_BIAS], r.y, r.saved);
    ts_gru_backward(&s->g, s->in[X], state, p[2], p[3], r.saved, s->in[DY], &r.to);
    for (int i = 0; i < 4; i++) free(p[i]);
    return r;
}

static results naive(const subject *s, bool old, bool add)
{
    results r = room(s, old, add);
    const float *state = old ? s->in[OLD] : NULL;
    ts_gru_forward_naive(&s->g, s->in[X], state, s->in[IH], s->in[IH_BIAS], s->in[HH], s->in[HH_BIAS], r.y, r.saved);
    ts_gru_backward_naive(&s->g, s->in[X], state, s->in[IH], s->in[HH], r.saved, s->in[DY], &r.to);
    return r;
}

/* Relative to the largest value, which sums of so many products are in proportion to. */
static void same(const char *what, const subject *s, const float *a, const float *b, size_t count, double bound)
{
    double most = 1;
    for (size_t i = 0; i < count; i++) most = farther(most, fabs(b[i]));
    for (size_t i = 0; i < count; i++)
        CHECK(fabs((double)a[i] - b[i]) <= bound * most, "%s, %s: %d pixels, %d to %d: value %zu is %.9g, naive %.9g",
              ts_isa_name(ts_isa_now()), what, (int)s->g.pixels, s->g.ic, s->g.c, i, a[i], b[i]);
}

TEST(gru_naive)
{
    static const int channels[] = {1, 2, 5, 15, 16, 17, 32, 33, 64},
                     pixels[] = {1, 13, 14, 15, 29, 111, 112, 113, 300, 2100};
    ts_rng r = ts_rng_make(30, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 40; i++) {
            subject s = make((ts_gru){pixels[i < 4 ? 9 : ts_rng_int(&r, 9)], channels[ts_rng_int(&r, 9)],
                                      channels[ts_rng_int(&r, i < 4 ? 5 : 9)], false, 0},
                             (uint64_t)i);
            results a = fast(&s, i % 3, i % 2), b = naive(&s, i % 3, i % 2);
            same("state", &s, a.y, b.y, s.counts[DY], 2e-5);
            same("saved", &s, a.saved, b.saved, 4 * s.counts[DY], 2e-5);
            same("dx", &s, a.dx, b.dx, s.counts[X], 1e-4);
            if (i % 3) same("dold", &s, a.dold, b.dold, s.counts[OLD], 1e-4);
            same("weights", &s, a.weights, b.weights, s.gradients, 1e-4);
            empty(&a), empty(&b), discard(&s);
        }
    }
}

TEST(gru_same_bytes_for_any_threads)
{
    for (int bf16 = 0; bf16 < 2; bf16++) {
        subject s = make((ts_gru){5000, 20, 32, bf16, 0}, 77);
        results first = {0};
        for (int threads = 1; threads <= 3; threads++) {
            ts_threads_set(threads);
            results r = fast(&s, true, false);
            if (threads == 1) {
                first = r;
                continue;
            }
            CHECK(!memcmp(first.y, r.y, s.counts[DY] * 4) && !memcmp(first.dx, r.dx, s.counts[X] * 4) &&
                      !memcmp(first.dold, r.dold, s.counts[OLD] * 4) &&
                      !memcmp(first.weights, r.weights, s.gradients * 4),
                  "other bytes with %d threads", threads);
            empty(&r);
        }
        empty(&first), discard(&s);
    }
    ts_threads_set(0);
}

static float *rounded(const float *x, size_t count)
{
    float *p = values(count, NULL);
    for (size_t i = 0; i < count; i++) p[i] = ts_bf16_naive(x[i]);
    return p;
}

/* The products of backward from the same gradients before the activations, which are rounded as the weights, x and the
 * state are; biases and what passes the gates are not. */
TEST(gru_backward_bf16_naive)
{
    static const int channels[] = {16, 32, 48, 64}, inputs[] = {1, 9, 16, 33, 128},
                     pixels[] = {1, 15, 17, 112, 113, 300, 2100};
    if (ts_isa_best() < TS_AMX) test_skip("this CPU has no %s", ts_isa_name(TS_AMX));
    ts_isa_use(TS_AMX);
    ts_rng r = ts_rng_make(32, TS_STREAM_TEST, 0);
    for (int i = 0; i < 30; i++) {
        const int ic = inputs[ts_rng_int(&r, 5)], c = channels[ts_rng_int(&r, 4)];
        subject s = make((ts_gru){pixels[i < 3 ? 6 : ts_rng_int(&r, 6)], ic, c, true, 0}, (uint64_t)i);
        const bool old = i % 3, add = i % 2;
        CHECK(ts_gru_backward_bf16(&s.g), "%d channels are not rounded", c);
        results a = fast(&s, old, add), b = room(&s, old, add);
        const size_t count = (size_t)s.g.pixels, gates = 3 * (size_t)c, n_ic = (size_t)ic, n_c = (size_t)c;
        float *d = values(4 * count * n_c, NULL), *own = values(count * n_c, NULL);
        memcpy(own, b.dold, count * n_c * sizeof *own);
        ts_elementwise_k()->gru_backward(s.g.pixels, c, a.saved, old ? s.in[OLD] : NULL, s.in[DY], d, own, add, NULL);
        float *dr = rounded(d, 4 * count * n_c), *ih = rounded(s.in[IH], gates * n_ic),
              *hh = rounded(s.in[HH], gates * n_c), *x = rounded(s.in[X], count * n_ic),
              *state = rounded(s.in[OLD], count * n_c);
        float *dx = values(count * n_ic, NULL), *weights = values(gates * (n_ic + n_c), NULL);
        for (size_t k = 0; k < gates * (n_ic + n_c); k++) weights[k] = 1;
        for (size_t p = 0; p < count; p++) {
            const float *now = dr + 4 * p * n_c; /* n, z, r, n' */
            for (size_t k = 0; k < n_ic; k++) {
                double sum = add;
                for (size_t m = 0; m < gates; m++) sum += (double)now[(m + n_c) % gates] * ih[m * n_ic + k];
                dx[p * n_ic + k] = (float)sum;
            }
            for (size_t k = 0; k < n_c; k++)
                for (size_t m = 0; m < gates; m++) own[p * n_c + k] += now[m + n_c] * hh[m * n_c + k];
        }
        for (size_t m = 0; m < gates; m++) {
            for (size_t k = 0; k < n_ic; k++) {
                double sum = 1;
                for (size_t p = 0; p < count; p++) sum += (double)dr[4 * p * n_c + (m + n_c) % gates] * x[p * n_ic + k];
                weights[m * n_ic + k] = (float)sum;
            }
            for (size_t k = 0; k < n_c; k++) {
                double sum = 1;
                for (size_t p = 0; p < count && old; p++) sum += (double)dr[4 * p * n_c + m + n_c] * state[p * n_c + k];
                weights[gates * n_ic + m * n_c + k] = (float)sum;
            }
        }
        same("dx", &s, a.dx, dx, s.counts[X], 1e-4);
        if (old) same("dold", &s, a.dold, own, s.counts[OLD], 1e-4);
        same("weights of the input", &s, a.weights, weights, gates * n_ic, 1e-4);
        same("weights of the state", &s, a.weights + gates * (n_ic + 1), weights + gates * n_ic, gates * n_c, 1e-4);
        float *const all[] = {d, own, dr, ih, hh, x, state, dx, weights};
        for (size_t k = 0; k < sizeof all / sizeof *all; k++) free(all[k]);
        empty(&a), empty(&b), discard(&s);
    }
}
