/* A displaced highlight, of a light beside the lens or of a sample that leans. */
#include "nn/lean.h"
#include "render/scene_model.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>

enum { SIDE = 128, PIXELS = SIDE * SIDE, C = MAP_CHANNELS };
static float maps[PIXELS * C], image[PIXELS * 3];

static void make_flat(void)
{
    for (int i = 0; i < PIXELS * C; i++) maps[i] = i % C >= MAP_SPECULAR ? -0.9f : 0;
    for (int i = 0; i < PIXELS; i++) {
        for (int k = 0; k < 3; k++) maps[i * C + MAP_DIFFUSE + k] = -1;
        maps[i * C + MAP_ROUGHNESS] = -0.6f;
    }
}

/* The highlight's centre in patch widths, x right and y up. */
static void find(const float number[RD_SCENE_NUMBERS], double at[2])
{
    double sum = 0;
    rd_scene_photograph(rd_grid_full(SIDE), maps, C, number, false, image);
    at[0] = at[1] = 0;
    for (int i = 0; i < PIXELS; i++) {
        const double weight = (double)image[i * 3];
        at[0] += weight * ((i % SIDE + 0.5) / SIDE - 0.5);
        at[1] += weight * (0.5 - (i / SIDE + 0.5) / SIDE);
        sum += weight;
    }
    at[0] /= sum, at[1] /= sum;
}

/* Whatever is taken from the light the slope gives back: the highlight stays. From further away the same displacement
 * is a smaller slope, and more of it is the sample's. */
TEST(lean_keeps_the_highlight_in_its_place)
{
    double left_before = 1;
    for (int far = 0; far < 2; far++) {
        float number[RD_SCENE_NUMBERS] = {
            [RD_SCENE_DISTANCE] = far ? 0.6f : 0, [RD_SCENE_LIGHT_X] = 1.5f, [RD_SCENE_LIGHT_Y] = -0.8f};
        double before[2], after[2];
        make_flat();
        find(number, before);
        nn_share_lean(PIXELS, C, 1, number, maps);
        find(number, after);
        for (int k = 0; k < 2; k++)
            CHECK(fabs(before[k]) > 0.02 && fabs(after[k] - before[k]) < 0.1 * fabs(before[k]),
                  "axis %d: the highlight went from %g to %g", k, before[k], after[k]);
        const double left = (double)number[RD_SCENE_LIGHT_X] / 1.5;
        CHECK(left > 0.1 && left < left_before - 0.1, "%g of the light's place is left, %g before", left, left_before);
        CHECK(fabs((double)number[RD_SCENE_LIGHT_Y] / -0.8 - left) < 1e-6, "x and y are shared alike");
        CHECK(maps[MAP_NORMAL] < -0.01f && maps[MAP_NORMAL + 1] > 0.005f, "normals lean by %g, %g",
              (double)maps[MAP_NORMAL], (double)maps[MAP_NORMAL + 1]);
        left_before = left;
    }
}

/* A light at the lens is left there, normals stay, and none leaves what maps can hold. */
TEST(lean_of_a_light_at_the_lens_is_none)
{
    float number[RD_SCENE_NUMBERS] = {0};
    make_flat();
    maps[MAP_NORMAL] = 0.25f;
    nn_share_lean(PIXELS, C, 1, number, maps);
    CHECK(maps[MAP_NORMAL] == 0.25f && maps[C + MAP_NORMAL] == 0, "normals moved");
    number[RD_SCENE_LIGHT_X] = -9;
    maps[MAP_NORMAL] = 1;
    nn_share_lean(PIXELS, C, 1, number, maps);
    CHECK(maps[MAP_NORMAL] == 1, "a normal of %g", (double)maps[MAP_NORMAL]);
}
