/* The centre square as scikit-image's resize makes it, against values that it made (tests/data/make_scikit.py), and
 * photographs with their stored values. */
#include "data/image/image.h"
#include "infer/photograph.h"
#include "nn/weights/weights.h"
#include "render/published.h"
#include "tests/data/scikit_values.h"
#include "tests/test.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static io_image picture(int side)
{
    ts_status st = {0};
    io_image image;
    CHECK(!io_image_create(&image, side, side, 3, &st), "%s", st.message);
    for (int i = 0; i < side * side * 3; i++) image.data[i] = (float)((uint32_t)i * 2654435761u >> 24) / 255.0f;
    return image;
}

/* Largest difference of every step-th value. */
static double difference(int from, int to, const float *expected, int step)
{
    ts_status st = {0};
    io_image in = picture(from), out;
    CHECK(!io_centre_square_scikit(&in, to, 0, &out, &st), "%s", st.message);
    double worst = 0;
    for (int i = 0; i < to * to * 3; i += step)
        worst = farther(worst, fabs((double)out.data[i] - (double)expected[i / step]));
    io_image_free(&in);
    io_image_free(&out);
    return worst;
}

TEST(scikit_resize_is_matched)
{
    const float *expected = scikit_values;
    for (size_t i = 0; i < sizeof scikit_cases / sizeof *scikit_cases; i++) {
        const int from = scikit_cases[i].from, to = scikit_cases[i].to;
        const double d = difference(from, to, expected, 1);
        CHECK(d < 5e-7, "%d to %d pixels: differs by %g", from, to, d);
        expected += to * to * 3;
    }
    CHECK(expected == scikit_values + sizeof scikit_values / sizeof *scikit_values, "the table has other sizes");
    const double d = difference(SCIKIT_LARGE, SCIKIT_LARGE_TO, scikit_large, SCIKIT_STEP);
    CHECK(d < 5e-7, "%d to %d pixels: differs by %g", SCIKIT_LARGE, SCIKIT_LARGE_TO, d);
}

TEST(scikit_square_is_the_centre)
{
    ts_status st = {0};
    io_image wide, out;
    CHECK(!io_image_create(&wide, 30, 10, 1, &st), "%s", st.message);
    for (int i = 0; i < 300; i++) wide.data[i] = (float)(i % 30);
    CHECK(!io_centre_square_scikit(&wide, 10, 0, &out, &st) && out.data[0] == 10 && out.data[9] == 19,
          "the middle third is not taken as it is");
    io_image_free(&out);
    CHECK(io_centre_square_scikit(&wide, 0, 0, &out, &st) == TS_INVALID, "size 0");
    io_image_free(&wide);
}

TEST(scikit_stored_values_of_photographs)
{
    ts_status st = {0};
    char path[512];
    io_image image, back;
    CHECK(!io_image_create(&image, 4, 2, 3, &st), "%s", st.message);
    for (int i = 0; i < 24; i++) image.data[i] = (float)i / 23;
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(!io_write_png(path, &image, 8, false, &st), "%s", st.message);
    CHECK(!io_read_stored(path, 1000, 2.2, &back, NULL, &st), "%s", st.message);
    for (int i = 0; i < 24; i++)
        CHECK(fabsf(back.data[i] * 255 - rintf(image.data[i] * 255)) < 1e-4f, "value %d is %g", i,
              (double)back.data[i]);
    CHECK(io_read_stored(path, 7, 2.2, &back, NULL, &st) != TS_OK, "more pixels than allowed");
    CHECK(io_read_stored("/nonexistent", 7, 2.2, &back, NULL, &st) == TS_IO && !back.data, "a missing file");
}

/* Which weights want which photograph, and that the power comes after the resampling: of 0 and 255 side by side the
 * published loader makes a dark grey. */
TEST(scikit_photographs_for_published_weights)
{
    ts_status st = {0};
    char path[512], weights[512];
    snprintf(path, sizeof path, "%s/p.png", test_folder());
    snprintf(weights, sizeof weights, "%s/w.safetensors", test_folder());
    for (int published = 0; published < 2; published++) {
        nn_arch a = nn_arch_default();
        a.g_width = 2, a.g_width_max = 2, a.g_levels = 1, a.h_width = 0, a.iterations = 0;
        if (published) a.compat = NN_COMPAT_PUBLISHED, a.descent = NN_DESCENT_NONE, a.rmse = NN_RMSE_BATCH;
        nn_model *m = nn_model_create(&a, &st);
        bool is = !published;
        CHECK(m && !nn_model_save(m, m->value, weights, NULL, 0, &st), "%s", st.message);
        CHECK(!lgd_weights_published(weights, &is, &st) && is == (published == 1), "published: %d, not %d: %s", is,
              published, st.message);
        nn_model_free(&m);
    }
    bool is;
    CHECK(lgd_weights_published("/nonexistent", &is, &st) == TS_IO && !is, "a missing file");
    io_image image, square;
    io_photo_facts facts;
    CHECK(!io_image_create(&image, 8, 8, 3, &st), "%s", st.message);
    for (int i = 0; i < 8 * 8 * 3; i++) image.data[i] = (float)(i / 3 % 2);
    CHECK(!io_write_png(path, &image, 8, false, &st) &&
              !lgd_photograph_square(path, true, 1000, 2, 0, &square, &facts, &st) && facts.width == 8 &&
              facts.height == 8,
          "%s", st.message);
    for (int i = 0; i < 12; i++)
        CHECK(fabs((double)square.data[i] - pow(0.5, rd_published.gamma)) < 0.02, "a fine pattern becomes %g",
              (double)square.data[i]);
    io_image_free(&square);
    CHECK(!lgd_photograph_square(path, false, 1000, 2, 0, &square, &facts, &st) && facts.width == 8 &&
              facts.height == 8,
          "%s", st.message);
    for (int i = 0; i < 12; i++)
        CHECK(fabs((double)square.data[i] - 0.5) < 0.1, "without compat a fine pattern becomes %g",
              (double)square.data[i]);
}
