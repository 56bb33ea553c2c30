/* What the tests of networks share: a tiny network, photographs for it, and comparisons. */
#ifndef TESTS_NETWORKS_H
#define TESTS_NETWORKS_H
#include "nn/layers.h"
#include "ops.h"
#include "render/render.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16, MOST = 16 };

static inline nn_arch tiny(void)
{
    nn_arch a = nn_arch_default();
    a.g_width = 4, a.g_width_max = 8, a.g_levels = 2, a.g_size = SIDE, a.h_width = 8, a.h_gru = 4, a.coarse_size = SIDE;
    return a;
}

static inline nn_model *create(const nn_arch *a, uint64_t seed)
{
    ts_status st = {0};
    nn_model *m = nn_model_create(a, &st);
    CHECK(m && !nn_model_train(m, &st), "model: %s", st.message);
    nn_model_init(m, seed);
    return m;
}

/* A network that guesses the scene and steps to the most probable maps; g reads 64 x 64 pixels. */
static inline nn_model *guessing(void)
{
    nn_arch a = tiny();
    a.g_unshuffle = 4, a.g_detail = 6, a.h_width = 0, a.descent = NN_DESCENT_POSTERIOR, a.iterations = 4;
    a.conditions = a.spread = a.scene = true;
    return create(&a, 81);
}

/* The same with an h that revises the maps of several photographs twice and changes them. */
static inline nn_model *revising(void)
{
    nn_arch a = tiny();
    a.g_unshuffle = 4, a.g_detail = 6, a.h_width = 0, a.descent = NN_DESCENT_POSTERIOR, a.iterations = 4;
    a.conditions = a.spread = a.scene = true;
    a.revisions = 2, a.revise_width = 8;
    nn_model *m = create(&a, 81);
    const nn_param *p = nn_model_find(m, "h.full.conv3.weight");
    ts_rng r = ts_rng_make(10, TS_STREAM_TEST, 0);
    for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] = ts_rng_range(&r, -0.02f, 0.02f);
    return m;
}

/* h begins as the identity; for tests of the loop its changes must count. */
static inline void enliven(nn_model *m)
{
    static const char *const last[] = {"h.output.weight", "coarse.output.weight"};
    for (int k = 0; k < 2; k++) {
        const nn_param *p = nn_model_find(m, last[k]);
        for (size_t i = 0; p && i < p->count; i++) m->value[p->offset + i] *= 200;
    }
}

static inline ag_tape *tape_create(bool gradients)
{
    ts_status st = {0};
    ag_tape *t = ag_tape_create(gradients, &st);
    CHECK(t, "tape: %s", st.message);
    return t;
}

static inline float *numbers(size_t count, uint64_t seed, float lo, float hi)
{
    float *p = malloc(count * sizeof *p);
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (size_t i = 0; i < count; i++) p[i] = ts_rng_range(&r, lo, hi);
    return p;
}

/* Flash photographs of random maps of side s. */
static inline nn_input photographs(int n, int s, uint64_t seed, float **maps)
{
    size_t pixels = (size_t)s * s;
    rd_view flash = rd_flash();
    float *m = numbers((size_t)n * pixels * 9, seed, -0.6f, 0.6f),
          *image = malloc((size_t)n * pixels * 3 * sizeof *image);
    for (int i = 0; i < n; i++)
        rd_render(rd_grid_full(s), m + (size_t)i * pixels * 9, 9, &flash, true, image + (size_t)i * pixels * 3);
    if (maps) *maps = m;
    else free(m);
    return (nn_input){.image = ts_view(image, (ts_shape){n, s, s, 3}), .grid = rd_grid_full(s), .view = flash};
}

static inline void check_tape(const ag_tape *t) { CHECK(!ag_status(t)->code, "tape: %s", ag_status(t)->message); }

static inline bool same(const ag_value *a, const ag_value *b)
{
    return ts_same(a->t.shape, b->t.shape) &&
        !memcmp(a->t.data, b->t.data, (size_t)ts_count(a->t.shape) * sizeof(float));
}
#endif
