/* How far the steps may go from what a model says. */
#include "nn/deviation.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>

enum { PIXELS = 5000 };
static float spread[PIXELS * NN_SPREADS], said[PIXELS * NN_SPREADS], other[PIXELS * NN_SPREADS];

static void say(void)
{
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) spread[i] = -2.0f + 0.001f * (float)(i % 3001);
}

/* A Laplace density's mean absolute error times the square root of 2 is its standard deviation; of F0 a part. */
TEST(deviation_is_that_of_a_laplace_density)
{
    say();
    nn_deviations(PIXELS, spread, (nn_belief){0}, 2, said);
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) {
        const double all = sqrt(2) * (double)NN_SPREAD_UNIT * exp((double)spread[i]),
                     part = (double)said[i] / (i % NN_SPREADS == GROUP_SPECULAR ? 0.2 : 1);
        CHECK(fabs(part - all) < 1e-5 * all, "value %d: %g in place of %g", i, part, all);
    }
}

/* Once the scene is found relief and roughness may move less, and nothing else changes. */
TEST(deviation_of_relief_is_less_once_the_scene_is_found)
{
    say();
    nn_deviations(PIXELS, spread, (nn_belief){0}, 1, said);
    nn_deviations(PIXELS, spread, (nn_belief){0}, 1, other);
    nn_deviations_of_found_scene(PIXELS, 2, other);
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) {
        const int k = i % NN_SPREADS;
        const bool less = k == GROUP_NORMAL || k == GROUP_ROUGHNESS;
        CHECK(fabsf(other[i] - (less ? 0.5f : 1) * said[i]) <= (less ? 1e-6f : 0) * said[i], "group %d: %g of %g", k,
              (double)other[i], (double)said[i]);
    }
}

/* What g says is believed less the more photographs follow, up to five of them. */
TEST(deviation_grows_with_the_photographs)
{
    static const int counts[] = {2, 3, 4, 5, 9};
    static const float times[] = {1, 1.16667f, 1.33333f, 1.5f, 1.5f};
    say();
    nn_deviations(PIXELS, spread, (nn_belief){.photographs = 2}, 1, said);
    for (int k = 0; k < 5; k++) {
        nn_deviations(PIXELS, spread, (nn_belief){.photographs = counts[k]}, 2, other);
        for (int i = 0; i < PIXELS * NN_SPREADS; i++)
            CHECK(fabsf(other[i] - times[k] * said[i]) <= 1e-4f * said[i], "%d photographs: %g of %g", counts[k],
                  (double)other[i], (double)said[i]);
    }
}

/* After a revision of several photographs' maps all of them may move less, F0 and roughness, whose levels h has found,
 * the least; of photographs of more pixels twice that. */
TEST(deviation_is_less_after_a_revision)
{
    static const double parts[NN_SPREADS] = {
        [GROUP_DIFFUSE] = 0.5, [GROUP_NORMAL] = 0.5, [GROUP_ROUGHNESS] = 0.25, [GROUP_SPECULAR] = 0.1};
    say();
    nn_deviations(PIXELS, spread, (nn_belief){.photographs = 5}, 1, said);
    for (int finer = 0; finer < 2; finer++) {
        nn_deviations(PIXELS, spread, (nn_belief){.photographs = 5, .revised = true, .finer = finer}, 2, other);
        for (int i = 0; i < PIXELS * NN_SPREADS; i++) {
            const double part = parts[i % NN_SPREADS] * (finer ? 2 : 1);
            CHECK(fabs((double)other[i] / (double)said[i] / part - 1) < 1e-5, "group %d: %g of %g", i % NN_SPREADS,
                  (double)other[i], (double)said[i]);
        }
    }
}
