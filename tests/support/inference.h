/* What the tests of the public C API share. */
#ifndef TESTS_INFERENCE_H
#define TESTS_INFERENCE_H
#include "infer/lgd.h"
#include "nn/weights/weights.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 24, T = 3, VALUES = SIDE * SIDE * MAP_CHANNELS };

static inline nn_arch tiny(void)
{
    nn_arch a = nn_arch_default();
    a.g_width = 4;
    a.g_width_max = 8;
    a.g_levels = 2;
    a.g_size = 16;
    a.h_width = 8;
    a.h_gru = 4;
    a.iterations = T;
    return a;
}

/* A model with random weights, through a file. The last layer of h is made large enough for a step to be seen. */
static inline lgd_model *load(nn_arch a)
{
    char path[256];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/tiny.safetensors", test_folder());
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 7);
    size_t first, last;
    nn_model_range(m, NN_H, &first, &last);
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (size_t i = first; i < last; i++) m->value[i] += ts_rng_range(&rng, -0.05f, 0.05f);
    CHECK(nn_model_save(m, m->value, path, NULL, 0, &st) == TS_OK, "%s", st.message);
    nn_model_free(&m);
    lgd_error e;
    lgd_model *loaded = lgd_load(path, &e);
    CHECK(loaded && e.code == 0 && !e.message[0], "%s", e.message);
    return loaded;
}

static inline void make_image(float *image, int side)
{
    ts_rng rng = ts_rng_make(11, TS_STREAM_TEST, (uint64_t)side);
    for (int i = 0; i < side * side * 3; i++) image[i] = 0.2f + 0.6f * ts_rng_uniform(&rng);
}

typedef struct trace {
    int calls, stop_at, step[16];
    double rmse[16];
} trace;

static inline int record(int step, double rmse, void *user)
{
    trace *t = user;
    CHECK(t->calls < 16, "more calls than steps");
    t->step[t->calls] = step;
    t->rmse[t->calls++] = rmse;
    return step == t->stop_at;
}

static inline void run(lgd_model *m, const float *image, int side, int iterations, int threads, trace *t, float *maps)
{
    lgd_error e = {.code = 77};
    const lgd_options o = {.size = sizeof o,
                           .iterations = iterations,
                           .threads = threads,
                           .progress = t ? record : NULL,
                           .user = t,
                           .every_rmse = 1};
    CHECK(lgd_estimate(m, image, side, &o, maps, &e) == 0 && e.code == 0 && !e.message[0], "%s", e.message);
}
#endif
