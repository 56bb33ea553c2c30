/* The tape: errors, memory, scopes, the same bytes for any number of threads. */
#include "ops.h"
#include "render/losses.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__ 1
#endif
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define COUNTS_ALLOCATIONS 1
/* The C library's allocator with a counter in front, for the whole test program. What libraries take for
 * themselves is their own affair: only calls from the program's own text count. */
static _Atomic long allocations;
extern char __executable_start, etext;
static void count_call(const void *from)
{
    if ((const char *)from >= &__executable_start && (const char *)from < &etext) allocations++;
}
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *p, size_t size);
void *__libc_memalign(size_t align, size_t size);
void *malloc(size_t size)
{
    count_call(__builtin_return_address(0));
    return __libc_malloc(size);
}
void *calloc(size_t count, size_t size)
{
    count_call(__builtin_return_address(0));
    return __libc_calloc(count, size);
}
void *realloc(void *p, size_t size)
{
    count_call(__builtin_return_address(0));
    return __libc_realloc(p, size);
}
void *aligned_alloc(size_t align, size_t size)
{
    count_call(__builtin_return_address(0));
    return __libc_memalign(align, size);
}
#endif

/* A small network with every kind of node: parameters in one block, as in training. */
enum { N = 2, SIDE = 48, WIDE = 10 };
static float values[40000], gradients[40000], photo[N * SIDE * SIDE * 3], truth[N * SIDE * SIDE * 9];
static int used;

static ag_value *param(ag_tape *tape, int n, int h, int w, int c)
{
    ts_shape s = {n, h, w, c};
    ag_value *v = ag_parameter(tape, ts_view(values + used, s), gradients + used);
    used += (int)ts_count(s);
    CHECK(used <= 40000, "the test's parameter block is too small");
    return v;
}

static void fill(float *x, int n, uint64_t index, float lo, float hi)
{
    ts_rng r = ts_rng_make(5, TS_STREAM_TEST, index);
    for (int i = 0; i < n; i++) x[i] = ts_rng_range(&r, lo, hi);
}

static ag_value *network(ag_tape *tape)
{
    used = 0;
    ag_value *x = ag_constant(tape, ts_view(photo, (ts_shape){N, SIDE, SIDE, 3}));
    ag_value *global = ag_selu(
        tape, ag_linear(tape, ag_channel_mean(tape, x), param(tape, 1, 1, WIDE, 3), param(tape, 1, 1, 1, WIDE)));
    ag_value *skip = ag_conv(tape, x, param(tape, WIDE, 3, 3, 3), param(tape, 1, 1, 1, WIDE), 1, TS_PAD_ZERO, 0.2f);
    ag_value *low = ag_conv(tape, ag_max_pool(tape, skip), param(tape, WIDE, WIDE, 5, 5), NULL, 1, TS_PAD_REPLICATE,
                            1.0f);
    low = ag_add_leaky(tape, ag_instance_norm(tape, low, 1e-5f), global, 0.2f);
    ag_value *both = ag_concat(tape, skip, ag_resize(tape, ag_upsample(tape, low), SIDE, SIDE));
    ag_value *ih = param(tape, 27, 2 * WIDE, 1, 1), *ih_bias = param(tape, 1, 1, 1, 27), *hh = param(tape, 27, 9, 1, 1),
             *hh_bias = param(tape, 1, 1, 1, 27);
    ag_value *state = ag_gru(tape, both, NULL, ih, ih_bias, hh, hh_bias);
    state = ag_gru(tape, both, state, ih, ih_bias, hh, hh_bias);
    ag_value *maps = ag_tanh(tape, ag_add(tape, ag_leaky(tape, ag_scale(tape, state, 3), 0.1f), state));
    return maps;
}

static ts_code train_step(ag_tape *tape)
{
    ag_reset(tape);
    memset(gradients, 0, sizeof gradients);
    ag_value *maps = network(tape);
    return ag_backward(tape,
                       ag_map_loss(tape, maps, ag_constant(tape, ts_view(truth, (ts_shape){N, SIDE, SIDE, 9})), NULL));
}

static ag_tape *prepared(bool needs)
{
    ts_status st = {0};
    ag_tape *tape = ag_tape_create(needs, &st);
    CHECK(tape, "%s", st.message);
    fill(values, 40000, 0, -0.3f, 0.3f);
    fill(photo, N * SIDE * SIDE * 3, 1, 0, 1);
    fill(truth, N * SIDE * SIDE * 9, 2, -1, 1);
    return tape;
}

TEST(tape_third_step_allocates_nothing)
{
#ifdef COUNTS_ALLOCATIONS
    ts_threads_set(2);
    ag_tape *tape = prepared(true);
    long before = allocations;
    void *volatile probe = malloc(10);
    free(probe);
    CHECK(allocations > before, "the counter does not count");
    for (int step = 1; step <= 5; step++) {
        before = allocations;
        CHECK(train_step(tape) == TS_OK, "%s", ag_status(tape)->message);
        CHECK(step < 3 || allocations == before, "step %d made %ld allocations", step, allocations - before);
    }
    ag_tape_destroy(&tape);
#else
    test_skip("the sanitizer owns the allocator");
#endif
}

TEST(tape_any_threads_same_bytes)
{
    static float first[40000], first_maps[N * SIDE * SIDE * 9];
    const int counts[] = {1, 2, 3, 7};
    ag_tape *tape = prepared(true);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int t = 0; t < 4; t++) {
            ts_threads_set(counts[t]);
            CHECK(train_step(tape) == TS_OK, "%s", ag_status(tape)->message);
            CHECK(gradients[0] != 0 && isfinite(gradients[0]), "the gradient is %g", (double)gradients[0]);
            if (t == 0) memcpy(first, gradients, sizeof first);
            CHECK(memcmp(first, gradients, sizeof first) == 0, "%s: gradients with %d threads differ",
                  ts_isa_name((ts_isa)isa), counts[t]);
            ag_reset(tape);
            const ag_value *maps = network(tape);
            CHECK(maps, "%s", ag_status(tape)->message);
            if (t == 0) memcpy(first_maps, maps->t.data, sizeof first_maps);
            CHECK(memcmp(first_maps, maps->t.data, sizeof first_maps) == 0, "%s: values with %d threads differ",
                  ts_isa_name((ts_isa)isa), counts[t]);
        }
    }
    ag_tape_destroy(&tape);
}

TEST(tape_gradients_or_not_same_values)
{
    ag_tape *with = prepared(true), *without = prepared(false);
    const ag_value *a = network(with), *b = network(without);
    CHECK(a && b && memcmp(a->t.data, b->t.data, (size_t)ts_count(a->t.shape) * sizeof(float)) == 0,
          "values differ without gradients");
    CHECK(a->needs_grad && !b->needs_grad, "who needs a gradient is wrong");
    CHECK(ts_arena_used(ag_arena(without)) < ts_arena_used(ag_arena(with)),
          "a tape without gradients keeps what backward would need");
    ag_tape_destroy(&with);
    ag_tape_destroy(&without);
}

TEST(tape_error_is_sticky)
{
    ag_tape *tape = prepared(true);
    static float w[18 * 20];
    ag_value *x = ag_constant(tape, ts_view(photo, (ts_shape){1, 4, 4, 18}));
    ag_value *weight = ag_constant(tape, ts_view(w, (ts_shape){18, 20, 1, 1}));
    CHECK(!ag_conv(tape, x, weight, NULL, 1, TS_PAD_ZERO, 1.0f), "a convolution of 18 channels with 20 went through");
    CHECK(ag_status(tape)->code == TS_INVALID &&
              strcmp(ag_status(tape)->message, "conv: input has 18 channels, weight wants 20") == 0,
          "message: %s", ag_status(tape)->message);
    /* Everything afterwards gives NULL, accepts NULL, and leaves the first message. */
    CHECK(!ag_add(tape, NULL, x) && !ag_tanh(tape, NULL) && !ag_gru(tape, NULL, NULL, NULL, NULL, NULL, NULL) &&
              !network(tape),
          "an op went on after the error");
    CHECK(!ag_constant(tape, ts_view(w, (ts_shape){1, 1, 1, 1})) && !ag_empty(tape, (ts_shape){1, 1, 1, 1}) &&
              !ag_detach(tape, x),
          "a leaf was made after the error");
    CHECK(ag_backward(tape, NULL) == TS_INVALID && strstr(ag_status(tape)->message, "weight wants 20"),
          "the first message was lost: %s", ag_status(tape)->message);
    ag_reset(tape);
    CHECK(ag_status(tape)->code == TS_OK && train_step(tape) == TS_OK, "the error survived the reset: %s",
          ag_status(tape)->message);
    ag_tape_destroy(&tape);
}

TEST(tape_shape_messages)
{
    ag_tape *tape = prepared(true);
#define REFUSED(call, text)                                                                                       \
    do {                                                                                                          \
        ag_reset(tape);                                                                                           \
        ag_value *x = ag_constant(tape, ts_view(photo, (ts_shape){2, 3, 4, 6}));                                  \
        ag_value *v = ag_constant(tape, ts_view(photo, (ts_shape){2, 1, 1, 5}));                                  \
        ag_value *w = ag_constant(tape, ts_view(photo, (ts_shape){1, 1, 7, 6}));                                  \
        ag_value *gates = ag_constant(tape, ts_view(photo, (ts_shape){3, 6, 1, 1})),                              \
                 *hidden = ag_constant(tape, ts_view(photo, (ts_shape){3, 1, 1, 1}));                             \
        ag_value *three = ag_constant(tape, ts_view(photo, (ts_shape){1, 1, 1, 3}));                              \
        (void)x, (void)v, (void)w, (void)gates, (void)hidden, (void)three;                                        \
        CHECK(!(call) && ag_status(tape)->code == TS_INVALID && strstr(ag_status(tape)->message, text), "%s: %s", \
              #call, ag_status(tape)->message);                                                                   \
    } while (0)
    REFUSED(ag_add(tape, x, v), "[2,3,4,6] and [2,1,1,5]");
    REFUSED(ag_add(tape, x, NULL), "input 1 is missing");
    REFUSED(ag_concat(tape, x, v), "differ in more than the channels");
    REFUSED(ag_linear(tape, x, w, NULL), "not [N,1,1,in]");
    REFUSED(ag_linear(tape, v, w, NULL), "5 channels, weight wants 6");
    REFUSED(ag_max_pool(tape, x), "must be even");
    REFUSED(ag_add_leaky(tape, x, v, 0.1f), "every pixel");
    REFUSED(ag_gru(tape, x, NULL, w, v, w, v), "not {3c,ic,1,1}");
    REFUSED(ag_gru(tape, x, v, gates, three, hidden, three), "the state is");
    REFUSED(ag_gru(tape, x, NULL, gates, v, hidden, three), "biases");
    REFUSED(ag_gru(tape, x, NULL, gates, three, gates, three), "not {3c,c,1,1}");
    REFUSED(ag_resize(tape, x, 0, 4), "0 x 4");
    REFUSED(ag_depth_to_space(tape, x, 1 << 16), "a multiple of 4294967296 channels");
    REFUSED(ag_leaky(tape, x, NAN), "leak");
    REFUSED(ag_instance_norm(tape, x, 0), "epsilon");
    REFUSED(ag_conv(tape, x, x, NULL, 1, TS_PAD_ZERO, 1), "not {oc,ic,k,k}");
    REFUSED(ag_constant(tape, ts_window(&x->t, 1, 1, 2, 2)), "strided");
    REFUSED((ag_backward(tape, x), NULL), "144 values");
#undef REFUSED
    ag_tape_destroy(&tape);
}

TEST(tape_unneeded_gradients_are_not_computed)
{
    ag_tape *tape = prepared(true);
    static float w[3 * 9], wg[3 * 9];
    ag_value *x = ag_constant(tape, ts_view(photo, (ts_shape){1, 1, 1, 3}));
    ag_value *unused = ag_tanh(tape, x); /* constants only: not recorded */
    ag_value *weight = ag_parameter(tape, ts_view(w, (ts_shape){1, 3, 3, 3}), wg);
    ag_value *y = ag_conv(tape, x, weight, NULL, 1, TS_PAD_ZERO, 1.0f);
    ag_value *aside = ag_scale(tape, y, 2); /* the loss does not read it */
    ag_value *cut = ag_detach(tape, y);
    ag_value *loss = ag_add(tape, y, cut);
    const size_t before = ts_arena_used(ag_arena(tape));
    CHECK(ag_backward(tape, loss) == TS_OK, "%s", ag_status(tape)->message);
    CHECK(!x->needs_grad && !x->grad && !unused->needs_grad && !unused->grad, "a constant got a gradient");
    CHECK(!cut->needs_grad && !cut->grad, "a detached value got a gradient");
    CHECK(aside->needs_grad && !aside->grad, "a value that the loss does not read got a gradient");
    CHECK(y->grad && wg[4] == photo[0] && wg[0] == 0, "the weight's centre got %g, not the pixel", (double)wg[4]);
    CHECK(ts_arena_used(ag_arena(tape)) > before, "gradients are made before they are needed");
    ag_reset(tape);
    float v = 1;
    ag_value *c = ag_constant(tape, ts_view(&v, (ts_shape){1, 1, 1, 1}));
    CHECK(ag_backward(tape, c) == TS_INVALID && strstr(ag_status(tape)->message, "any parameter"), "message: %s",
          ag_status(tape)->message);
    ag_tape_destroy(&tape);
}

TEST(tape_scope_gives_memory_back)
{
    ag_tape *tape = prepared(false);
    ag_value *state = ag_constant(tape, ts_view(truth, (ts_shape){N, SIDE, SIDE, 9}));
    ag_value *outside = ag_scale(tape, state, 0.5f), *plain = state;
    size_t held = 0;
    for (int step = 0; step < 6; step++) {
        ts_mark mark = ag_scope_begin(tape);
        ag_value *x = ag_tanh(tape, ag_add(tape, state, ag_scale(tape, outside, 0.1f)));
        ag_value *keep[4] = {x, outside, NULL, ag_scale(tape, x, 2)};
        const ag_value *same = outside;
        ag_scope_end(tape, mark, keep, 4);
        CHECK(keep[0] && keep[3] && !keep[2] && keep[1] == same, "the wrong values survived");
        for (int64_t i = 0; i < ts_count(keep[0]->t.shape); i++)
            CHECK(keep[3]->t.data[i] == 2 * keep[0]->t.data[i], "step %d: value %lld was damaged by the move", step,
                  (long long)i);
        state = keep[0];
        plain = ag_tanh(tape, ag_add(tape, plain, ag_scale(tape, outside, 0.1f)));
        CHECK(memcmp(state->t.data, plain->t.data, (size_t)ts_count(state->t.shape) * sizeof(float)) == 0,
              "step %d: the scope changed a value", step);
        mark = ag_scope_begin(tape);
        const size_t before = ts_arena_used(ag_arena(tape));
        ag_scale(tape, ag_tanh(tape, state), 3);
        ag_scope_end(tape, mark, NULL, 0);
        CHECK(ts_arena_used(ag_arena(tape)) == before, "an empty scope keeps %zu bytes",
              ts_arena_used(ag_arena(tape)) - before);
        held = before;
    }
    CHECK(held < 6 * 6 * sizeof truth, "six steps hold %zu bytes", held);
    ag_tape_destroy(&tape);
    /* with gradients a scope does nothing */
    tape = prepared(true);
    ts_mark mark = ag_scope_begin(tape);
    ag_value *maps = network(tape), *keep[1] = {maps};
    ag_scope_end(tape, mark, keep, 1);
    CHECK(keep[0] == maps, "a scope moved a value that backward needs");
    CHECK(ag_backward(tape,
                      ag_map_loss(tape, maps, ag_constant(tape, ts_view(truth, (ts_shape){N, SIDE, SIDE, 9})), NULL)) ==
              TS_OK,
          "%s", ag_status(tape)->message);
    ag_tape_destroy(&tape);
}

/* The weights of a frozen tape, which may be destroyed before the one beside it. */
TEST(tape_beside_another_shares_its_packed_weights)
{
    ts_status st = {0};
    static float w[4 * 3 * 9];
    fill(w, 4 * 3 * 9, 3, -1, 1);
    const ts_conv c = {1, 8, 8, 3, 4, 3, 1, TS_PAD_ZERO, 0, {0}};
    ag_tape *tape = prepared(false);
    ag_freeze(tape, false);
    CHECK(!ag_tape_sharing(tape, &st) && st.code == TS_INVALID, "beside one whose weights change");
    ag_freeze(tape, true);
    ag_tape *other = ag_tape_sharing(tape, &st);
    CHECK(other, "%s", st.message);
    const float *packed = ag_packed(other, &c, TS_CONV_FORWARD, w), first = packed[0];
    ag_reset(other);
    CHECK(ag_packed(tape, &c, TS_CONV_FORWARD, w) == packed, "packed for each");
    ag_tape_destroy(&tape);
    CHECK(ag_packed(other, &c, TS_CONV_FORWARD, w) == packed && packed[0] == first, "gone with the first tape");
    ag_tape_destroy(&other);
}

TEST(tape_frozen_weights_are_packed_once)
{
    ag_tape *tape = prepared(false);
    static float w[4 * 3 * 9];
    fill(w, 4 * 3 * 9, 3, -1, 1);
    const ts_conv c = {1, 8, 8, 3, 4, 3, 1, TS_PAD_ZERO, 0, {0}};
    for (int frozen = 0; frozen < 2; frozen++) {
        ag_freeze(tape, frozen);
        ag_reset(tape);
        ag_value *x = ag_constant(tape, ts_view(photo, (ts_shape){1, 8, 8, 3}));
        w[0] = 1;
        float first = ag_conv(tape, x, ag_constant(tape, ts_view(w, (ts_shape){4, 3, 3, 3})), NULL, 1, TS_PAD_ZERO,
                              1.0f)
                          ->t.data[9 * 4];
        CHECK(ag_packed(tape, &c, TS_CONV_FORWARD, w) == ag_packed(tape, &c, TS_CONV_FORWARD, w),
              "packed twice in one step");
        CHECK(ag_packed(tape, &c, TS_CONV_FORWARD, w) != ag_packed(tape, &c, TS_CONV_DATA_GRADIENT, w),
              "one packing for two uses");
        w[0] = 2; /* an optimiser's step */
        ag_reset(tape);
        x = ag_constant(tape, ts_view(photo, (ts_shape){1, 8, 8, 3}));
        float second = ag_conv(tape, x, ag_constant(tape, ts_view(w, (ts_shape){4, 3, 3, 3})), NULL, 1, TS_PAD_ZERO,
                               1.0f)
                           ->t.data[9 * 4];
        CHECK(frozen ? first == second : first != second, "frozen %d: %g then %g", frozen, (double)first,
              (double)second);
    }
    ag_tape_destroy(&tape);
}

TEST(into_writes_where_it_is_told)
{
    ts_status st = {0};
    float a[6] = {1, 2, 3, 4, 5, 6}, b[6] = {6, 5, 4, 3, 2, 1}, more[4] = {0};
    ag_tape *tape = ag_tape_create(false, &st);
    CHECK(tape, "%s", st.message);
    ag_value *x = ag_constant(tape, ts_view(a, (ts_shape){1, 1, 2, 3})),
             *y = ag_constant(tape, ts_view(b, (ts_shape){1, 1, 2, 3}));
    ag_into(tape, x);
    CHECK(ag_add(tape, x, y) == x && a[0] == 7 && a[5] == 7, "the sum is not where it was to go");
    CHECK(ag_add(tape, x, y) != x && a[0] == 7, "the next operation went there too");
    ag_into(tape, ag_constant(tape, ts_view(more, (ts_shape){1, 1, 2, 2})));
    CHECK(!ag_add(tape, x, y) && strstr(ag_status(tape)->message, "the place for it"), "%s", ag_status(tape)->message);
    ag_tape_destroy(&tape);
    tape = ag_tape_create(true, &st);
    x = ag_constant(tape, ts_view(a, (ts_shape){1, 1, 2, 3}));
    ag_into(tape, x);
    CHECK(!ag_add(tape, x, x) && strstr(ag_status(tape)->message, "keeps every value"), "%s", ag_status(tape)->message);
    ag_tape_destroy(&tape);
}
