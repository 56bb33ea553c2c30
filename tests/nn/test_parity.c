/* The published network, with the fixture's formula for its weights: g and h as the published code computes them
 * (fixtures/README.md). */
#include "nn/layers.h"
#include "nn/weights/weights.h"
#include "ops.h"
#include "render/published.h"
#include "render/render.h"
#include "tests/test.h"
#include "train/config.h"
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

/* The published network with the formula's weights. */
static nn_model *published(void)
{
    ts_status st = {0};
    tr_config c = tr_config_default();
    CHECK(!tr_config_read(&c, "configs/paper.ini", &st), "%s", st.message);
    nn_model *m = nn_model_create(&c.arch, &st);
    CHECK(m, "%s", st.message);
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        double scale = 0.01;
        if (p->rank > 1) {
            scale = sqrt(3 / ((double)p->count / p->dim[0]));
            if (!strncmp(p->name, "main_net", 8)) scale *= 0.5;
            if (!strcmp(p->name, "main_net.rnn.layers.2.input_fun.conv_layer.weight")) scale *= 8;
        }
        const uint64_t hash = name_hash(p->name);
        for (int64_t j = 0; j < (int64_t)p->count; j++)
            m->value[p->offset + (size_t)j] = (float)scale * formula(hash, (uint64_t)j);
    }
    return m;
}

/* A tensor of the fixture, [channels][256][256], as [256][256][channels]. */
static float *stored(const nn_file *f, const char *name, int channels)
{
    ts_status st = {0};
    size_t pixels = (size_t)SIDE * SIDE;
    float *planes = malloc(pixels * (size_t)channels * sizeof *planes),
          *out = malloc(pixels * (size_t)channels * sizeof *out);
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

/* Largest and mean |x - y| of values of a picture with so many channels; most 0: only the mean is bounded. */
static void compare(const char *what, const float *x, const float *y, int channels, double most, double mean)
{
    double worst = 0, sum = 0;
    for (int i = 0; i < SIDE * SIDE * channels; i++) {
        const double d = fabs((double)x[i] - y[i]);
        worst = fmax(worst, d);
        sum += d;
    }
    sum /= SIDE * SIDE * channels;
    printf("  %s: largest difference %.2g, mean %.2g\n", what, worst, sum);
    CHECK((most == 0 || worst < most) && sum < mean, "%s: largest difference %g (%g is allowed), mean %g (%g)", what,
          worst, most, sum, mean);
}

typedef struct seen {
    const nn_model *model;
    const nn_input *in;
    const nn_file *f;
    float *first;
} seen;

/* R_0, its rendering and gradient, and the first update. */
static bool look(int step, const ag_value *maps, void *user)
{
    seen *s = user;
    const float *r = maps->t.data;
    const size_t values = (size_t)SIDE * SIDE * CHANNELS;
    if (step == 0) {
        double rmse;
        float *image = malloc(values * sizeof *image);
        const rd_view view = rd_published_flash();
        compare("g.output", r, stored(s->f, "g.output", CHANNELS), CHANNELS, 2e-5, 2e-6);
        rd_render(s->in->grid, r, CHANNELS, &view, true, image);
        compare("step0.render", image, stored(s->f, "step0.render", 3), 3, 4e-4, 2e-6);
        rd_flash_rmse(s->in->grid, r, CHANNELS, &view, s->in->image.data, &rmse);
        float *gradient = calloc(values, sizeof *gradient);
        rd_flash_gradient(s->in->grid, r, CHANNELS, &view, s->in->image.data, rmse, gradient, NULL);
        compare("step0.grad_x1e5", gradient, stored(s->f, "step0.grad_x1e5", CHANNELS), CHANNELS, 0, 1.5e-5);
        memcpy(s->first, r, values * sizeof *r);
    } else if (step == 1) {
        for (size_t i = 0; i < values; i++) s->first[i] = r[i] - s->first[i];
        compare("step0.delta", s->first, stored(s->f, "step0.delta", CHANNELS), CHANNELS, 1e-3, 3e-6);
    }
    return true;
}

/* exact: as lgd-infer --exact computes it, else as it does by itself. */
static void whole(bool exact)
{
#ifdef __SANITIZE_ADDRESS__
    test_skip("265 billion multiplications take too long with sanitizers; parity_of_the_refiner runs");
#endif
    nn_file *f = fixture();
    nn_model *m = published();
    float *image = stored(f, "input.image", 3);
    ts_status st = {0};
    ag_tape *t = ag_tape_create(false, &st);
    ag_compute_set(t, (ts_compute){.exact = exact});
    nn_input in = {
        .image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    seen s = {m, &in, f, malloc((size_t)SIDE * SIDE * CHANNELS * sizeof(float))};
    ag_value *out = NULL;
    CHECK(!nn_lgd(t, m, &in, m->arch.iterations, false, &out, &(nn_watch){look, &s, false}), "%s",
          ag_status(t)->message);
    compare("lgd.output", out->t.data, stored(f, "lgd.output", CHANNELS), CHANNELS, 0, 3e-3);
}

TEST(parity_with_the_published_network) { whole(false); }
TEST(parity_with_the_published_network_directly) { whole(true); }

/* The renderer and h alone, from the stored R_0: nothing of g's rounding is in these. */
static void refiner(bool exact)
{
    nn_file *f = fixture();
    nn_model *m = published();
    float *maps = stored(f, "g.output", CHANNELS), *image = stored(f, "input.image", 3),
          *gradient = calloc((size_t)SIDE * SIDE * CHANNELS, sizeof(float));
    float *expected = stored(f, "step0.grad_x1e5", CHANNELS);
    double rmse;
    ts_status st = {0};
    ag_tape *t = ag_tape_create(false, &st);
    ag_compute_set(t, (ts_compute){.exact = exact});
    const ts_shape s = {1, SIDE, SIDE, CHANNELS};
    const rd_view view = rd_published_flash();
    const rd_grid grid = rd_grid_full(SIDE);
    rd_flash_rmse(grid, maps, CHANNELS, &view, image, &rmse);
    rd_flash_gradient(grid, maps, CHANNELS, &view, image, rmse, gradient, NULL);
    compare("step0.grad_x1e5", gradient, expected, CHANNELS, 2e-2,
            5e-7); /* the rounding of the stored R_0 alone makes 9.9e-3 and 1.3e-7 */
    ag_value *gru[2] = {NULL, NULL};
    ag_value *delta = nn_change(t, m, &((const nn_layers *)m->layers)->h, ag_constant(t, ts_view(maps, s)),
                                ag_constant(t, ts_view(expected, s)), gru, NULL);
    CHECK(delta, "%s", ag_status(t)->message);
    compare("step0.delta", delta->t.data, stored(f, "step0.delta", CHANNELS), CHANNELS, 1e-6, 1e-7);
}

TEST(parity_of_the_refiner) { refiner(false); }
TEST(parity_of_the_refiner_directly) { refiner(true); }
