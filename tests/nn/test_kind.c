/* Maps of a sample whose kind is told. */
#include "nn/kind.h"
#include "nn/model.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS + 1, PIXELS = 50, VALUES = PIXELS * C };

static void draw(float diffuse, float f0, float *maps)
{
    ts_rng rng = ts_rng_make(8, TS_STREAM_TEST, 0);
    for (int i = 0; i < VALUES; i++) {
        const int c = i % C;
        const float of = c < MAP_NORMAL ? diffuse : c < MAP_SPECULAR ? 0.5f : f0;
        maps[i] = 2 * of * ts_rng_range(&rng, 0.5f, 1.5f) - 1;
    }
}

static double value(const float *maps, int pixel, int channel) { return ((double)maps[pixel * C + channel] + 1) / 2; }

static double mean(const float *maps, int map)
{
    double sum = 0;
    for (int i = 0; i < PIXELS * 3; i++) sum += value(maps, i / 3, map + i % 3);
    return sum / PIXELS / 3;
}

/* Normals, roughness and what is beyond the maps. */
static bool others_stay(const float *before, const float *after)
{
    for (int i = 0; i < VALUES; i++)
        if (i % C >= MAP_NORMAL && i % C < MAP_SPECULAR && before[i] != after[i]) return false;
    for (int i = MAP_CHANNELS; i < VALUES; i += C)
        if (before[i] != after[i]) return false;
    return true;
}

TEST(kind_metal_has_its_brightness_in_f0)
{
    float before[VALUES], maps[VALUES];
    draw(0.3f, 0.04f, before);
    memcpy(maps, before, sizeof maps);
    CHECK(nn_take_kind(NN_KIND_METAL, false, PIXELS, C, maps) == 0 && others_stay(before, maps), "other maps");
    for (int i = 0; i < PIXELS * 3; i++) {
        const double f0 = value(maps, i / 3, MAP_SPECULAR + i % 3),
                     want = value(before, i / 3, MAP_SPECULAR + i % 3) +
            (double)NN_METAL_F0 * value(before, i / 3, MAP_DIFFUSE + i % 3);
        CHECK(fabs(f0 - want) < 1e-6, "value %d: F0 %g, not %g", i, f0, want);
        CHECK(value(maps, i / 3, MAP_DIFFUSE + i % 3) <= 0.02 + 1e-6, "value %d: diffuse", i);
    }
}

/* What looked dark and smooth under a strong light is a metal under a weak one. */
TEST(kind_metal_is_no_black_plastic)
{
    float before[VALUES], maps[VALUES];
    draw(0.01f, 0.04f, before);
    memcpy(maps, before, sizeof maps);
    const double stops = (double)nn_take_kind(NN_KIND_METAL, false, PIXELS, C, maps);
    CHECK(others_stay(before, maps) && fabs(mean(maps, MAP_SPECULAR) - 0.4) < 1e-5, "F0 %g", mean(maps, MAP_SPECULAR));
    for (int i = 0; i < PIXELS * 3; i++) {
        const int p = i / 3, d = MAP_DIFFUSE + i % 3, f = MAP_SPECULAR + i % 3;
        CHECK(fabs(value(maps, p, f) * exp2(stops) - value(before, p, f) - (double)NN_METAL_F0 * value(before, p, d)) <
                  1e-6,
              "value %d: F0 %g", i, value(maps, p, f));
    }
    memcpy(maps, before, sizeof maps);
    CHECK(nn_take_kind(NN_KIND_METAL, true, PIXELS, C, maps) == 0 && mean(maps, MAP_SPECULAR) < 0.1, "a known light");
}

/* Two readings of one photograph: as bright for each pixel under the light that is stronger by what is returned; or, if
 * the light may not change, F0's loss is in diffuse. */
TEST(kind_dielectric_is_no_metal)
{
    float before[VALUES], maps[VALUES], known[VALUES];
    draw(0.03f, 0.5f, before);
    memcpy(maps, before, sizeof maps), memcpy(known, before, sizeof known);
    const double stops = (double)nn_take_kind(NN_KIND_DIELECTRIC, false, PIXELS, C, maps);
    CHECK(nn_take_kind(NN_KIND_DIELECTRIC, true, PIXELS, C, known) == 0, "a known light changed");
    CHECK(others_stay(before, maps) && others_stay(before, known), "other maps");
    CHECK(fabs(mean(maps, MAP_SPECULAR) - 0.04) < 1e-5 && fabs(mean(known, MAP_SPECULAR) - 0.04) < 1e-5, "F0 %g, %g",
          mean(maps, MAP_SPECULAR), mean(known, MAP_SPECULAR));
    for (int i = 0; i < PIXELS * 6; i++) {
        const int p = i / 6, c = i % 6 < 3 ? MAP_DIFFUSE + i % 3 : MAP_SPECULAR + i % 3;
        CHECK(fabs(value(maps, p, c) * exp2(stops) - value(before, p, c)) < 1e-5, "pixel %d, channel %d: %g", p, c,
              value(maps, p, c));
    }
    for (int i = 0; i < PIXELS * 3; i++) {
        const int p = i / 3, d = MAP_DIFFUSE + i % 3, f = MAP_SPECULAR + i % 3;
        CHECK(fabs(value(known, p, d) + value(known, p, f) / (double)NN_METAL_F0 - value(before, p, d) -
                   value(before, p, f) / (double)NN_METAL_F0) < 1e-5,
              "value %d: diffuse %g", i, value(known, p, d));
    }
}

TEST(kind_that_is_read_right_or_not_told_changes_nothing)
{
    float before[VALUES], maps[VALUES];
    draw(0.3f, 0.06f, before);
    memcpy(maps, before, sizeof maps);
    CHECK(nn_take_kind(NN_KIND_DIELECTRIC, false, PIXELS, C, maps) == 0 && !memcmp(maps, before, sizeof maps),
          "a dielectric was changed");
    draw(0.1f, 0.6f, before);
    memcpy(maps, before, sizeof maps);
    CHECK(nn_take_kind(NN_KIND_UNKNOWN, false, PIXELS, C, maps) == 0 && !memcmp(maps, before, sizeof maps),
          "what is not told was changed");
}

TEST(kind_leaves_little_open)
{
    for (int kind = NN_KIND_UNKNOWN; kind <= NN_KIND_METAL; kind++) {
        float deviation[PIXELS * MAP_GROUPS];
        for (int i = 0; i < PIXELS * MAP_GROUPS; i++) deviation[i] = i < PIXELS ? 0.01f : 0.3f;
        nn_deviations_of_kind((nn_kind)kind, PIXELS, deviation);
        for (int i = 0; i < PIXELS * MAP_GROUPS; i++) {
            const int g = i % MAP_GROUPS;
            const bool certain = (kind == NN_KIND_METAL && g == GROUP_DIFFUSE) ||
                (kind == NN_KIND_DIELECTRIC && g == GROUP_SPECULAR);
            CHECK(deviation[i] ==
                      (i < PIXELS    ? 0.01f
                           : certain ? 0.02f
                                     : 0.3f),
                  "kind %d, group %d: %g", kind, g, (double)deviation[i]);
        }
    }
}
