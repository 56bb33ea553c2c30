/* R_0 made worse for h to learn from. */
#include "tensor/maps.h"
#include "tests/test.h"
#include "train/disturb.h"
#include <math.h>
#include <string.h>

enum { SIDE = 64, PIXELS = SIDE * SIDE, VALUES = PIXELS * MAP_CHANNELS, DRAWS = 400 };
static float flat[VALUES], maps[VALUES], again[VALUES];

/* Flat, grey, with a slope that nobody could miss. */
static void make_flat(float diffuse, float f0)
{
    for (int i = 0; i < VALUES; i++) {
        const int c = i % MAP_CHANNELS;
        flat[i] = c < MAP_NORMAL ? 2 * diffuse - 1 : c < MAP_ROUGHNESS ? 0.2f : c == MAP_ROUGHNESS ? -0.2f : 2 * f0 - 1;
    }
}

static void disturb(double share, uint64_t index, float *to)
{
    memcpy(to, flat, sizeof flat);
    tr_disturb(share, 7, index, SIDE, to);
}

/* A share of the materials, each another way and always the same; values stay those that maps can have. */
TEST(disturb_is_a_function_of_the_material)
{
    make_flat(0.4f, 0.05f);
    int changed = 0;
    for (uint64_t i = 0; i < DRAWS; i++) {
        disturb(0, i, maps);
        CHECK(!memcmp(maps, flat, sizeof flat), "material %d changes where none is to", (int)i);
        disturb(0.5, i, maps);
        disturb(0.5, i, again);
        CHECK(!memcmp(maps, again, sizeof flat), "material %d is not the same again", (int)i);
        changed += memcmp(maps, flat, sizeof flat) != 0;
        for (int k = 0; k < VALUES; k++) CHECK(maps[k] >= -1 && maps[k] <= 1, "a value of %g", (double)maps[k]);
    }
    CHECK(changed > DRAWS * 0.4 && changed < DRAWS * 0.6, "%d of %d change", changed, DRAWS);
    disturb(1, 1, maps);
    disturb(1, 2, again);
    CHECK(memcmp(maps, again, sizeof flat), "two materials are off in the same way");
}

/* Some dielectrics become metals and some metals dielectrics, and nothing else does. */
TEST(disturb_takes_some_for_metals)
{
    for (int metal = 0; metal < 2; metal++) {
        int other = 0;
        make_flat(metal ? 0.02f : 0.4f, metal ? 0.6f : 0.04f);
        for (uint64_t i = 0; i < DRAWS; i++) {
            disturb(1, i, maps);
            double diffuse = 0, f0 = 0;
            for (int k = 0; k < PIXELS; k++) {
                diffuse += (double)maps[k * MAP_CHANNELS + MAP_DIFFUSE];
                f0 += (double)maps[k * MAP_CHANNELS + MAP_SPECULAR];
            }
            other += (f0 > diffuse) != metal;
        }
        CHECK(other > DRAWS / 40 && other < DRAWS / 6, "%d of %d %s change their kind", other, DRAWS,
              metal ? "metals" : "dielectrics");
    }
}
