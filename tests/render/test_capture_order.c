/* The order in which a model reads several photographs: that of their views, whatever the order they are given in. */
#include "render/scene.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { MOST = 5 };

TEST(capture_order_is_that_of_the_views)
{
    ts_rng r = ts_rng_make(4, TS_STREAM_TEST, 0);
    for (int trial = 0; trial < 50; trial++) {
        const int count = 1 + trial % RD_CAPTURE_VIEWS;
        rd_view views[RD_CAPTURE_VIEWS], shuffled[RD_CAPTURE_VIEWS];
        int order[RD_CAPTURE_VIEWS];
        rd_capture_draw(&r, count, views);
        for (int i = 0; i < count; i++) {
            const int to = ts_rng_int(&r, i + 1);
            shuffled[i] = shuffled[to];
            shuffled[to] = views[i];
        }
        rd_capture_order(shuffled, count, order);
        for (int i = 0; i < count; i++)
            CHECK(!memcmp(views[i].light, shuffled[order[i]].light, sizeof views[i].light),
                  "view %d of %d depends on the order that is given", i, count);
    }
}

/* All cameras with the flash beside the lens: the light's distance from the camera, and its direction, which is the
 * phone's roll, say nothing of where the phone was. */
TEST(capture_order_of_a_sheet_is_from_above_then_around)
{
    ts_rng r = ts_rng_make(5, TS_STREAM_TEST, 0);
    for (int trial = 0; trial < 200; trial++) {
        const int count = 2 + trial % 4;
        rd_view views[MOST], shuffled[MOST];
        int order[MOST];
        double mean[2] = {0, 0}, last = -1e-4;
        rd_sheet_draw(&r, count, views);
        for (int i = 0; i < count; i++) {
            const int to = ts_rng_int(&r, i + 1);
            for (int k = 0; k < 2; k++) mean[k] += (double)views[i].camera[k] / count;
            shuffled[i] = shuffled[to];
            shuffled[to] = views[i];
        }
        rd_capture_order(shuffled, count, order);
        for (int i = 0; i < count; i++) {
            const rd_view *v = &shuffled[order[i]];
            const double slope = hypot((double)v->camera[0], (double)v->camera[1]) / (double)v->camera[2];
            CHECK(!memcmp(views[i].camera, v->camera, sizeof v->camera), "view %d of %d depends on the order", i,
                  count);
            CHECK((i == 0) == (slope < 0.15), "the camera of view %d of %d has a slope of %g", i, count, slope);
            if (i == 0) continue;
            double angle = atan2((double)v->light[1] - mean[1], (double)v->light[0] - mean[0]);
            if (angle < 0) angle += 6.283185307179586;
            CHECK(angle >= last, "view %d is at %g, the one before at %g", i, angle, last);
            last = angle;
        }
    }
}

/* Views that nothing but their own numbers sets apart: cameras in a row, each with its flash at the lens. */
TEST(capture_order_of_ties_is_one)
{
    static const float place[4] = {0.2f, 0.4f, 0.6f, -1.2f};
    static const int given[][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {3, 2, 1, 0}, {2, 0, 3, 1}};
    rd_view want[4] = {{0}};
    for (size_t trial = 0; trial < sizeof given / sizeof *given; trial++)
        for (int diagonal = 0; diagonal < 2; diagonal++) {
            rd_view views[4];
            int order[4];
            for (int i = 0; i < 4; i++) {
                views[i] = rd_flash();
                views[i].camera[0] = views[i].light[0] = place[given[trial][i]];
                if (diagonal) views[i].camera[1] = views[i].light[1] = place[given[trial][i]];
            }
            rd_capture_order(views, 4, order);
            for (int i = 0; i < 4 && trial + (size_t)diagonal == 0; i++) want[i] = views[order[i]];
            for (int i = 0; i < 4; i++)
                CHECK(views[order[i]].camera[0] == want[i].camera[0], "trial %d: view %d is at %g, not %g", (int)trial,
                      i, (double)views[order[i]].camera[0], (double)want[i].camera[0]);
        }
}
