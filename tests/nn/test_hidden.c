/* Diffuse under a highlight, and F0 beside it. */
#include "nn/hidden.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 128, PIXELS = SIDE * SIDE, C = MAP_CHANNELS };
static const float scene[RD_SCENE_NUMBERS];
static float maps[PIXELS * C], filled[PIXELS * C], image[PIXELS * 3];

static float distance(int i)
{
    return hypotf((float)(i % SIDE) - 0.5f * (SIDE - 1), (float)(i / SIDE) - 0.5f * (SIDE - 1)) / SIDE;
}

/* A material of albedo .4, .3, .2 whose every other pixel is a fifth brighter, with a disk of a third of the albedo. */
static void make(float roughness, float f0, float disk)
{
    const float albedo[3] = {0.4f, 0.3f, 0.2f};
    for (int i = 0; i < PIXELS; i++) {
        float *m = maps + i * C;
        memset(m, 0, C * sizeof *m);
        for (int k = 0; k < 3; k++) {
            m[MAP_DIFFUSE + k] = 2 * albedo[k] * (i % 2 ? 1.2f : 1) * (distance(i) < disk ? 1 / 3.0f : 1) - 1;
            m[MAP_SPECULAR + k] = 2 * f0 - 1;
        }
        m[MAP_ROUGHNESS] = 2 * roughness - 1;
    }
}

static void fill(int threads, float *to)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    memcpy(to, maps, sizeof maps);
    CHECK(arena && !nn_fill_hidden(rd_grid_on(rd_grid_full(SIDE), threads), image, scene, C, arena, to, &st), "%s",
          st.message);
    ts_arena_destroy(&arena);
}

/* The disk ends where the highlight does: diffuse becomes that of the surroundings, and keeps its detail and hue. */
TEST(hidden_diffuse_is_that_of_the_surroundings)
{
    make(0.25f, 0.3f, 0.08f);
    fill(1, filled);
    double sum = 0, contrast = 0;
    int count = 0;
    for (int i = 0; i < PIXELS; i += 2) {
        if (distance(i) > 0.03f || i % SIDE == SIDE - 1) continue;
        const float even = (filled[i * C] + 1) / 2, odd = (filled[(i + 1) * C] + 1) / 2,
                    green = (filled[i * C + 1] + 1) / 2;
        sum += (double)even, contrast += (double)(odd / even), count++;
        CHECK(fabsf(green / even - 0.75f) < 0.02f, "a hue of %g", green / even);
    }
    CHECK(count > 5 && sum / count > 0.33 && sum / count < 0.43, "albedo .133 became %g, not .4", sum / count);
    CHECK(fabs(contrast / count - 1.2) < 0.03, "contrast %g, not 1.2", contrast / count);
    for (int i = 0; i < PIXELS; i++)
        for (int k = MAP_NORMAL; k < C; k++)
            CHECK(fabsf(filled[i * C + k] - maps[i * C + k]) < (k < MAP_SPECULAR ? 0 : 1e-5f) + 1e-9f,
                  "channel %d changed", k);
}

/* Black tiles beside the disk neither darken the wall nor keep the disk from being filled, and stay black. */
TEST(hidden_diffuse_ends_where_the_material_does)
{
    const int edge = 5 * SIDE / 8;
    make(0.25f, 0.3f, 0.08f);
    for (int i = edge * SIDE; i < PIXELS; i++)
        for (int k = 0; k < 3; k++) maps[i * C + MAP_DIFFUSE + k] = 2 * 0.02f - 1;
    fill(1, filled);
    double disk = 0;
    double wall = 0, tiles = 0;
    int count = 0;
    for (int i = 0; i < PIXELS; i += 2) {
        const float now = (filled[i * C] + 1) / 2, change = fabsf(logf(now / ((maps[i * C] + 1) / 2)));
        if (distance(i) < 0.03f) disk += (double)now, count++;
        else if (i / SIDE >= edge + 4) tiles = farther(tiles, (double)change);
        else if (i / SIDE < edge - 4 && distance(i) > 0.16f) wall = farther(wall, (double)change);
    }
    CHECK(disk / count > 0.33 && disk / count < 0.43, "albedo .133 became %g, not .4", disk / count);
    CHECK(wall < 0.1, "the wall is changed by e^%g", wall);
    CHECK(tiles < 0.3, "black is changed by e^%g", tiles);
}

/* What is seen stays: a disk on a matt material is the material's own. */
TEST(hidden_diffuse_leaves_what_is_seen)
{
    make(0.9f, 0.04f, 0.2f);
    fill(1, filled);
    for (int i = 0; i < PIXELS * C; i++)
        CHECK(fabsf((filled[i] + 1) / (maps[i] + 1) - 1) < 0.05f, "%g became %g", maps[i], filled[i]);
    make(0.25f, 0.3f, 0);
    fill(1, filled);
    for (int i = 0; i < PIXELS * C; i++)
        CHECK(fabsf((filled[i] + 1) / (maps[i] + 1) - 1) < 0.02f, "without a disk %g became %g", maps[i], filled[i]);
}

/* Where the photograph burnt out next to nothing is seen, though the rendering has no highlight there. */
TEST(hidden_diffuse_is_filled_where_the_photograph_burnt_out)
{
    double sum[2] = {0};
    int count = 0;
    for (int burnt = 0; burnt < 2; burnt++) {
        make(0.9f, 0.04f, 0.08f);
        for (int i = 0; i < PIXELS; i++)
            for (int k = 0; k < 3; k++) image[i * 3 + k] = burnt && distance(i) < 0.1f ? 1 : 0.2f;
        fill(1, filled);
        for (int i = 0; i < PIXELS; i += 2)
            if (distance(i) < 0.03f) sum[burnt] += ((double)filled[i * C] + 1) / 2, count++;
    }
    memset(image, 0, sizeof image);
    CHECK(sum[0] / (count / 2) < 0.16, "albedo .133 that is seen became %g", sum[0] / (count / 2));
    CHECK(sum[1] / (count / 2) > 0.25, "albedo .133 that is not seen became %g, about .4 is right",
          sum[1] / (count / 2));
}

/* The largest change of a logarithm where a map's three values are a and b in stripes. */
static float change_of_stripes(int at, int width, float a, float b)
{
    float most = 0;
    for (int i = 0; i < PIXELS; i++)
        for (int k = at; k < at + 3; k++) maps[i * C + k] = 2 * (i % SIDE / width % 2 ? a : b) - 1;
    fill(1, filled);
    for (int i = 0; i < PIXELS; i++)
        for (int k = at; k < at + 3; k++)
            most = (float)farther((double)most, (double)fabsf(logf((filled[i * C + k] + 1) / (maps[i * C + k] + 1))));
    return most;
}

/* Stripes and ground under a highlight stay apart: were their differences not expected, both would come out alike. */
TEST(hidden_diffuse_leaves_a_pattern)
{
    make(0.25f, 0.1f, 0);
    const float most = change_of_stripes(MAP_DIFFUSE, 16, 0.8f, 0.2f);
    CHECK(most < 0.8f, "a value is changed by e^%g", most);
}

/* Stripes of one hue: a redder disk under the highlight takes theirs; light and dark ones stay apart. */
TEST(hidden_hue_is_that_of_the_surroundings)
{
    const float hue[3] = {1, 0.75f, 0.5f};
    make(0.25f, 0.3f, 0);
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++)
            maps[i * C + MAP_DIFFUSE + k] =
                2 * hue[k] * (i % SIDE / 16 % 2 ? 0.6f : 0.2f) * (k == 0 && distance(i) < 0.08f ? 1.3f : 1) - 1;
    fill(1, filled);
    for (int i = 0; i < PIXELS; i++) {
        if (distance(i) > 0.03f) continue;
        const float red = (filled[i * C] + 1) / 2, green = (filled[i * C + 1] + 1) / 2,
                    before = (maps[i * C + 1] + 1) / 2;
        CHECK(fabsf(green / red - 0.75f) < 0.04f, "a hue of %g, .58 before, .75 around", green / red);
        CHECK(fabsf(logf(green / before)) < 0.8f, "a level of %g, %g before", green, before);
    }
}

/* Black things are not hidden, though most of their light is mirrored. */
TEST(hidden_diffuse_leaves_what_is_dark)
{
    make(0.5f, 0.04f, 0);
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++) maps[i * C + MAP_DIFFUSE + k] = i / SIDE < SIDE / 4 ? 2 * 0.01f - 1 : 2 * 0.7f - 1;
    fill(1, filled);
    double most = 0;
    for (int i = 0; i < PIXELS / 8; i++) most = farther(most, ((double)filled[i * C] + 1) / 2);
    CHECK(most < 0.015, "an albedo of .01 beside .7 becomes %g", most);
}

/* F0 beside a highlight, a guess, goes most of the way to that of the highlight, and keeps its detail; that of the
 * highlight stays. */
TEST(hidden_f0_is_that_of_the_highlight)
{
    make(0.3f, 0.05f, 0);
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++)
            maps[i * C + MAP_SPECULAR + k] = 2 * 0.05f * (distance(i) > 0.25f ? 0.5f : 1) * (i % 2 ? 1.1f : 1) - 1;
    fill(1, filled);
    double inside = 0, outside = 0, contrast = 0;
    int in = 0, out = 0;
    for (int i = 0; i < PIXELS; i += 2) {
        const double even = ((double)filled[i * C + MAP_SPECULAR] + 1) / 2,
                     odd = ((double)filled[(i + 1) * C + MAP_SPECULAR] + 1) / 2;
        if (distance(i) < 0.05f) inside += even, in++;
        if (distance(i) > 0.35f) outside += even, contrast += odd / even, out++;
    }
    CHECK(fabs(inside / in - 0.05) < 0.003, "F0 of .05 in the highlight became %g", inside / in);
    CHECK(outside / out > 0.037 && outside / out < 0.053, "F0 of .025 beside it became %g, not .05", outside / out);
    CHECK(fabs(contrast / out - 1.1) < 0.01, "contrast %g, not 1.1", contrast / out);
}

/* Where F0 differs in what is seen of it too, as of metal beside paint, what is not seen is left alone. */
TEST(hidden_f0_leaves_a_pattern)
{
    make(0.3f, 0.05f, 0);
    const float most = change_of_stripes(MAP_SPECULAR, 8, 0.6f, 0.04f);
    CHECK(most < 0.8f, "F0 is changed by e^%g, where the two differ by e^2.7", most);
}

TEST(hidden_maps_are_the_same_for_any_number_of_threads)
{
    static float again[PIXELS * C];
    make(0.25f, 0.3f, 0.08f);
    fill(1, filled);
    fill(3, again);
    CHECK(!memcmp(filled, again, sizeof again), "three threads make other bytes");
}
