/* Several photographs of a material at once. */
#include "nn/weights/weights.h"
#include "tensor/maps.h"
#include "tests/support/networks.h"
#include <stdio.h>

enum { IMAGES = 3, PIXELS = SIDE * SIDE };

static nn_arch several(void)
{
    nn_arch a = tiny();
    a.images = IMAGES;
    a.descent = NN_DESCENT_GRADIENT;
    return a;
}

/* given photographs of n materials under configurations 0, 1, 2 (from k of each material onwards). */
static nn_input captures(int n, int given, float **maps)
{
    static rd_view views[8];
    nn_input in = photographs(n, SIDE, 31, maps);
    float *image = malloc((size_t)n * (size_t)given * PIXELS * 3 * sizeof *image);
    for (int i = 0; i < n * given; i++) {
        views[i] = rd_capture_view((i + i / given) % RD_CAPTURE_VIEWS);
        rd_render(in.grid, *maps + (size_t)(i / given) * PIXELS * 9, 9, &views[i], true,
                  image + (size_t)i * PIXELS * 3);
    }
    in.image = ts_view(image, (ts_shape){n * given, SIDE, SIDE, 3});
    in.views = views;
    in.given = given;
    return in;
}

/* Begun from a model of one photograph: what that gives from the first. */
TEST(nn_images_begin_with_the_first)
{
    nn_arch one = tiny(), many = several();
    one.descent = NN_DESCENT_GRADIENT;
    nn_model *m = create(&one, 41), *more = create(&many, 42);
    enliven(m);
    char path[] = "/tmp/lgd_imagesXXXXXX";
    ts_status st = {0};
    int taken, left;
    CHECK(mkstemp(path) >= 0, "no temporary file");
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    CHECK(!nn_model_init_from(more, path, NULL, &taken, &left, &st) && taken == m->params && left == 0,
          "%d taken, %d left: %s", taken, left, st.message);
    remove(path);
    nn_input in = photographs(2, SIDE, 32, NULL), copies = in;
    float *image = malloc(2 * IMAGES * PIXELS * 3 * sizeof *image);
    for (size_t i = 0; i < 2 * IMAGES; i++)
        for (size_t j = 0; j < PIXELS * 3; j++)
            image[i * PIXELS * 3 + j] = i % IMAGES ? 0.1f * (float)(i + j % 7)
                                                   : in.image.data[i / IMAGES * PIXELS * 3 + j];
    copies.image = ts_view(image, (ts_shape){2 * IMAGES, SIDE, SIDE, 3});
    copies.given = IMAGES;
    ag_tape *t = tape_create(false), *u = tape_create(false);
    ag_value *a[4], *b[4];
    CHECK(!nn_lgd(t, m, &in, 3, true, a, NULL), "%s", ag_status(t)->message);
    CHECK(!nn_lgd(u, more, &copies, 3, true, b, NULL), "%s", ag_status(u)->message);
    for (int step = 0; step <= 3; step++)
        for (int64_t i = 0; i < ts_count(a[step]->t.shape); i++)
            CHECK(fabsf(a[step]->t.data[i] - b[step]->t.data[i]) < 1e-4f, "step %d, value %lld: %g and %g", step,
                  (long long)i, (double)a[step]->t.data[i], (double)b[step]->t.data[i]);
}

/* With h silent a step is R - 0.003/3 times the sum of the encoded gradients, one for each photograph under its own
 * light. */
TEST(nn_images_have_a_gradient_each)
{
    nn_arch arch = several();
    nn_model *m = create(&arch, 43);
    const nn_param *p = nn_model_find(m, "h.output.weight");
    memset(m->value + p->offset, 0, p->count * sizeof *m->value);
    for (int given = 1; given <= IMAGES; given++) {
        float *truth, gradient[PIXELS * 9];
        nn_input in = captures(2, given, &truth);
        ag_tape *t = tape_create(false);
        ag_value *maps[2];
        CHECK(!nn_lgd(t, m, &in, 1, true, maps, NULL), "%s", ag_status(t)->message);
        for (int n = 0; n < 2; n++) {
            const float *start = maps[0]->t.data + (size_t)n * PIXELS * 9,
                        *end = maps[1]->t.data + (size_t)n * PIXELS * 9;
            double sum[PIXELS * 9] = {0};
            for (int k = 0; k < given; k++) {
                const int i = n * given + k;
                const float *image = in.image.data + (size_t)i * PIXELS * 3;
                double rmse;
                rd_flash_rmse(in.grid, start, 9, &in.views[i], image, &rmse);
                rd_flash_gradient(in.grid, start, 9, &in.views[i], image, rmse, gradient, NULL);
                for (int j = 0; j < PIXELS * 9; j++) sum[j] += asinh(10 * (double)gradient[j]);
            }
            for (int j = 0; j < PIXELS * 9; j++)
                CHECK(fabs(end[j] - (start[j] - 0.001 * sum[j])) < 1e-5, "%d given, material %d, value %d: %g, not %g",
                      given, n, j, (double)end[j], start[j] - 0.001 * sum[j]);
        }
        ag_tape_destroy(&t);
    }
}

/* With h silent a step is half of the one that fits all photographs. */
TEST(nn_images_meet_in_a_newton_step)
{
    nn_arch arch = several();
    arch.descent = NN_DESCENT_NEWTON;
    nn_model *m = create(&arch, 46);
    const nn_param *p = nn_model_find(m, "h.output.weight");
    memset(m->value + p->offset, 0, p->count * sizeof *m->value);
    for (int given = 1; given <= IMAGES; given++) {
        float *truth, step[PIXELS * 9], damping[9];
        for (int i = 0; i < 9; i++) damping[i] = i < MAP_SPECULAR ? 0.1f : 1;
        nn_input in = captures(2, given, &truth);
        ag_tape *t = tape_create(false);
        ag_value *maps[2];
        CHECK(!nn_lgd(t, m, &in, 1, true, maps, NULL), "%s", ag_status(t)->message);
        for (int n = 0; n < 2; n++) {
            const float *start = maps[0]->t.data + (size_t)n * PIXELS * 9,
                        *end = maps[1]->t.data + (size_t)n * PIXELS * 9, *image[IMAGES];
            for (int k = 0; k < given; k++) image[k] = in.image.data + (size_t)(n * given + k) * PIXELS * 3;
            rd_newton_step(in.grid, start, 9, in.views + n * given, image, given, damping, step);
            for (int j = 0; j < PIXELS * 9; j++)
                CHECK(fabsf(end[j] - (start[j] + 0.5f * step[j])) < 1e-5f,
                      "%d given, material %d, value %d: %g, not %g", given, n, j, (double)end[j],
                      (double)(start[j] + 0.5f * step[j]));
        }
        ag_tape_destroy(&t);
    }
    nn_model_free(&m);
}

TEST(nn_images_that_are_not_given_are_black_to_g)
{
    nn_arch arch = several();
    nn_model *m = create(&arch, 44);
    float *truth;
    nn_input two = captures(1, 2, &truth), three = captures(1, 3, &truth);
    memcpy(three.image.data, two.image.data, 2 * PIXELS * 3 * sizeof(float));
    memset(three.image.data + 2 * PIXELS * 3, 0, PIXELS * 3 * sizeof(float));
    ag_tape *t = tape_create(false);
    ag_value *a = nn_predict(t, m, &two), *b = nn_predict(t, m, &three);
    check_tape(t);
    CHECK(same(a, b), "a photograph that is not given is not a black one");
    two.image.data[0] = three.image.data[0] = 0.9f;
    memset(three.image.data + 2 * PIXELS * 3, 1, PIXELS * 3 * sizeof(float));
    three.image.data[2 * PIXELS * 3] = 0.5f;
    CHECK(!same(a, nn_predict(t, m, &three)), "g does not read the third photograph");
}

TEST(nn_images_more_than_the_model_reads)
{
    nn_arch arch = several();
    nn_model *m = create(&arch, 45);
    float *truth;
    nn_input in = captures(1, IMAGES + 1, &truth);
    ag_tape *t = tape_create(false);
    CHECK(!nn_predict(t, m, &in) && ag_status(t)->code == TS_INVALID &&
              strstr(ag_status(t)->message, "4 photographs are given: the model reads 3"),
          "%s", ag_status(t)->message);
    arch.rmse = NN_RMSE_BATCH;
    ts_status st = {0};
    CHECK(nn_arch_check(&arch, &st) == TS_INVALID && strstr(st.message, "images"), "%s", st.message);
}
