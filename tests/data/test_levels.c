/* Levels of the procedural materials that training varies: brightness, gloss, relief, and both of plain ones. */
#include "data/materials/procedural.h"
#include "tests/data/new_material.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

TEST(procedural_darker_multiplies_diffuse_colours_by_one_factor)
{
    enum { COUNT = 48, SIZE = 16 };
    const io_procedural plain = {.seed = 5}, dark = {.seed = 5, .darker = 1}, half = {.seed = 5, .darker = 0.5f};
    int changed = 0, halves = 0;
    double stops = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&dark, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        double least = 1, most = 0, wrong = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            const float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            CHECK(!memcmp(from + MAP_NORMAL, to + MAP_NORMAL, (MAP_CHANNELS - MAP_NORMAL) * sizeof(float)),
                  "material %d: F0, roughness or normals changed with the diffuse colours", i);
            for (int v = MAP_DIFFUSE; v < MAP_DIFFUSE + 3; v++) {
                const double before = (from[v] + 1) / 2, after = (to[v] + 1) / 2;
                wrong = fmax(wrong, after - before);
                if (after < 0.005) continue; /* at the least albedo, or near enough for its rounding to show */
                least = fmin(least, after / before), most = fmax(most, after / before);
            }
        }
        CHECK(wrong < 1e-6, "material %d: a value is %g brighter", i, wrong);
        if (most > 0) { /* a bare metal has no diffuse colour */
            CHECK(least > 0.1249 && most - least < 2e-4, "material %d: factors of %g to %g", i, least, most);
            stops -= log2(most), changed++;
        }
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(changed > COUNT / 2 && halves > COUNT / 6 && halves < 5 * COUNT / 6, "%d and %d of %d changed", changed,
          halves, COUNT);
    CHECK(fabs(stops / changed - 1.5) < 0.4, "darker by %g stops, 1.5 is the mean of 0 .. 3", stops / changed);
}

TEST(procedural_smoother_multiplies_roughness_by_one_factor)
{
    enum { COUNT = 48, SIZE = 16 };
    const io_procedural families = {.seed = 5}, smooth = {.seed = 5, .smoother = 1},
                        half = {.seed = 5, .smoother = 0.5f};
    int halves = 0;
    double logs = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&families, (uint64_t)i, &a);
        io_procedural_make(&smooth, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        double least = 1, most = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            const double before = (from[MAP_ROUGHNESS] + 1) / 2, after = (to[MAP_ROUGHNESS] + 1) / 2;
            CHECK(after <= before + 1e-6, "material %d: roughness from %g to %g", i, before, after);
            to[MAP_ROUGHNESS] = from[MAP_ROUGHNESS];
            if (after < 0.0301) continue; /* the least roughness of maps */
            least = fmin(least, after / before), most = fmax(most, after / before);
        }
        CHECK(!memcmp(a.maps, b.maps, material_values(SIZE) * sizeof(float)), "material %d: another map changed", i);
        CHECK(least > 0.449 && most - least < 1e-4, "material %d: factors of %g to %g", i, least, most);
        logs += log(most);
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
    CHECK(fabs(logs / COUNT + 0.4) < 0.1, "log factors have a mean of %g, -.4 is that of -.8 .. 0", logs / COUNT);
}

/* The height's slope along x or y, which maps have as s / sqrt(1 + .16 |s|^2): 2.5 at most. */
static double slope_of(const float *pixel, int k)
{
    const double x = (double)pixel[MAP_NORMAL], y = (double)pixel[MAP_NORMAL + 1], square = x * x + y * y;
    return (k ? y : x) / sqrt(1 - square - 0.16 * square);
}

TEST(procedural_steeper_multiplies_slopes_by_one_factor)
{
    enum { COUNT = 48, SIZE = 16 };
    const io_procedural families = {.seed = 5}, steep = {.seed = 5, .steeper = 1}, half = {.seed = 5, .steeper = 0.5f};
    int changed = 0, halves = 0;
    double logs = 0, smallest = 4, largest = 1;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&families, (uint64_t)i, &a);
        io_procedural_make(&steep, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        double least = INFINITY, most = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            for (int c = 0; c < 2; c++) {
                const double before = slope_of(from, c), after = slope_of(to, c);
                if (fabs(before) < 0.01 || fabs(after) > 5) continue; /* where rounding shows */
                least = fmin(least, after / before), most = fmax(most, after / before);
            }
            memcpy(to + MAP_NORMAL, from + MAP_NORMAL, 2 * sizeof *to);
        }
        CHECK(!memcmp(a.maps, b.maps, material_values(SIZE) * sizeof(float)), "material %d: another map changed", i);
        io_material_free(&a);
        io_material_free(&b);
        if (most == 0) continue; /* it is flat */
        CHECK(least > 0.999 && most < 4.004 && most - least < 2e-3 * most, "material %d: factors of %g to %g", i, least,
              most);
        smallest = fmin(smallest, most), largest = fmax(largest, most);
        logs += log(most), changed++;
    }
    CHECK(smallest < 1.15 && largest > 3.5, "factors of %g to %g", smallest, largest);
    CHECK(changed > COUNT / 2 && halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d, and %d at a share of a half",
          changed, halves);
    CHECK(fabs(logs / changed - log(2)) < 0.15, "log factors have a mean of %g, log 2 is that of 0 .. log 4",
          logs / changed);
}

/* RMS of a map's differences from its mean, of normals from straight up. */
static double varied(const io_material *m, int map)
{
    double sum = 0, squares = 0;
    const int count = m->size * m->size;
    for (int i = 0; i < count; i++) {
        const double v = (double)m->maps[i * MAP_CHANNELS + map];
        sum += map == MAP_NORMAL || map == MAP_NORMAL + 1 ? 0 : v;
        squares += v * v;
    }
    return sqrt(fmax(squares / count - sum / count * (sum / count), 0));
}

static float largest(const io_material *m, int map, int channels)
{
    float most = -1;
    for (int i = 0; i < m->size * m->size; i++)
        for (int k = 0; k < channels; k++) most = fmaxf(most, m->maps[i * MAP_CHANNELS + map + k]);
    return most;
}

/* A third of the differences is left in the mean of u^2. */
TEST(plain_materials_have_one_gloss_and_hardly_any_relief)
{
    enum { COUNT = 96, SIZE = 64 };
    const io_procedural families = {.seed = 5}, plain = {.seed = 5, .plain = 1}, half = {.seed = 5, .plain = 0.5f};
    int halves = 0, dielectrics = 0;
    double relief[2] = {0}, gloss[2] = {0};
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&families, (uint64_t)i, &a);
        io_procedural_make(&plain, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        relief[0] += varied(&a, MAP_NORMAL), relief[1] += varied(&b, MAP_NORMAL);
        gloss[0] += varied(&a, MAP_ROUGHNESS), gloss[1] += varied(&b, MAP_ROUGHNESS);
        const bool dielectric = largest(&a, MAP_SPECULAR, 3) <= 2 * 0.2f - 1;
        dielectrics += dielectric;
        for (int k = 0; k < SIZE * SIZE; k++) {
            const float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            for (int c = 0; c < 3; c++) {
                const int map = MAP_SPECULAR + c;
                CHECK(from[MAP_DIFFUSE + c] == to[MAP_DIFFUSE + c], "material %d: diffuse of pixel %d", i, k);
                CHECK(to[map] == (dielectric ? b.maps : from)[map], "material %d: F0 of pixel %d", i, k);
            }
        }
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
    CHECK(dielectrics > COUNT / 3 && dielectrics < COUNT, "%d of %d are dielectrics", dielectrics, COUNT);
    CHECK(relief[1] < 0.5 * relief[0] && relief[1] > 0.15 * relief[0], "relief %g of %g", relief[1], relief[0]);
    CHECK(gloss[1] < 0.5 * gloss[0] && gloss[1] > 0.15 * gloss[0], "gloss %g of %g", gloss[1], gloss[0]);
}
