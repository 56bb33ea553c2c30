/* The published network, with the fixture's formula for its weights: g and h as the published code computes them (fixtures/README.md). */
#include "nn/layers.h"
#include "nn/weights.h"
#include "ops.h"
#include "tests/published.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, CHANNELS = 10 };

static uint64_t name_hash(const char *s)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (; *s; s++) h = (h ^ (unsigned char)*s) * 0x100000001b3u;
    return h;
}

static float formula(uint64_t hash, uint64_t i)
{
    uint64_t z = hash + i * 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return (float)(z >> 40) / 8388608.0f - 1;
}

/* The parameters of one of the two networks; the other's memory is never touched. */
static nn_model *published(bool refiner)
{
    ts_status st = {0};
    nn_arch a = published_arch();
    char name[160], shape[64], ours[160], path[1024], line[256];
    snprintf(path, sizeof path, "%s/paper_tensors.tsv", test_fixtures());
    FILE *f = fopen(path, "r");
    if (!f) test_skip("%s is absent", path);
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    while (fgets(line, sizeof line, f)) {
        CHECK(sscanf(line, "%159s %63s", name, shape) == 2, "line %s", line);
        bool h = !strncmp(name, "main_net", 8);
        if (h != refiner || !published_name(name, ours, sizeof ours)) continue;
        const nn_param *p = nn_model_find(m, ours);
        CHECK(p, "no %s", ours);
        double scale = 0.01;
        if (p->rank > 1) {
            scale = sqrt(3 / ((double)p->count / p->dim[0]));
            if (h) scale *= 0.5;
            if (!strcmp(ours, "h.output.weight")) scale *= 8;
        }
        uint64_t hash = name_hash(name);
#pragma omp parallel for
        for (int64_t i = 0; i < (int64_t)p->count; i++) m->value[p->offset + (size_t)i] = (float)scale * formula(hash, (uint64_t)i);
    }
    fclose(f);
    return m;
}

/* A tensor of the fixture, [channels][256][256], as [256][256][channels]. */
static float *stored(const nn_file *f, const char *name, int channels)
{
    ts_status st = {0};
    size_t pixels = (size_t)SIDE * SIDE;
    float *planes = malloc(pixels * (size_t)channels * sizeof *planes), *out = malloc(pixels * (size_t)channels * sizeof *out);
    CHECK(!nn_file_read(f, name, 3, (int64_t[]){channels, SIDE, SIDE}, planes, &st), "%s", st.message);
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) out[i * (size_t)channels + (size_t)c] = planes[(size_t)c * pixels + i];
    free(planes);
    return out;
}

static nn_file *fixture(void)
{
    char path[1024];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/paper_parity.safetensors", test_fixtures());
    nn_file *f = nn_safetensors_open(path, &st);
    if (st.code == TS_IO) test_skip("%s is absent", path);
    CHECK(f, "%s", st.message);
    return f;
}

static void compare(const float *x, const float *y, double most, double mean)
{
    double worst = 0, sum = 0;
    for (int i = 0; i < SIDE * SIDE * CHANNELS; i++) {
        double d = fabs((double)x[i] - y[i]);
        worst = fmax(worst, d);
        sum += d;
    }
    sum /= SIDE * SIDE * CHANNELS;
    printf("  largest difference %.2g, mean %.2g\n", worst, sum);
    CHECK(worst < most && sum < mean, "largest difference %g (%g is allowed), mean %g (%g)", worst, most, sum, mean);
}

TEST(parity_g_is_the_published_one)
{
#ifdef __SANITIZE_ADDRESS__
    test_skip("106 billion multiplications take too long with sanitizers; parity_h runs");
#endif
    nn_file *f = fixture();
    nn_model *m = published(false);
    float *image = stored(f, "input.image", 3), *expected = stored(f, "g.output", CHANNELS);
    ts_status st = {0};
    ag_tape *t = ag_tape_create(false, &st);
    nn_input in = {.image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    ag_value *maps = nn_predict(t, m, &in);
    CHECK(maps, "%s", ag_status(t)->message);
    compare(maps->t.data, expected, 2e-5, 2e-6); /* PyTorch in float32: 1.7e-5 and 1.5e-6 */
}

TEST(parity_h_is_the_published_one)
{
    nn_file *f = fixture();
    nn_model *m = published(true);
    float *maps = stored(f, "g.output", CHANNELS), *gradient = stored(f, "step0.grad_x1e5", CHANNELS), *expected = stored(f, "step0.delta", CHANNELS);
    ts_status st = {0};
    ag_tape *t = ag_tape_create(false, &st);
    ts_shape s = {1, SIDE, SIDE, CHANNELS};
    ag_value *gru[2] = {NULL, NULL};
    ag_value *delta = nn_refiner(t, m, ag_concat(t, ag_constant(t, ts_view(maps, s)), ag_constant(t, ts_view(gradient, s))), gru, NULL);
    CHECK(delta, "%s", ag_status(t)->message);
    compare(delta->t.data, expected, 1e-4, 4e-6);
}
