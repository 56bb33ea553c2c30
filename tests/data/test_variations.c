/* What training varies of the procedural materials: families, hues, relief, blends, slopes. */
#include "data/materials/blend.h"
#include "data/materials/procedural.h"
#include "tests/data/new_material.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

static int drawn(const io_procedural *p, const char *family, int count)
{
    int found = 0;
    io_material m = new_material(8);
    for (int i = 0; i < count; i++) {
        io_procedural_make(p, (uint64_t)i, &m);
        found += !strncmp(m.name + 6, family, strlen(family));
    }
    io_material_free(&m);
    return found;
}

TEST(procedural_families_are_drawn_more_often)
{
    const uint64_t two = io_family_mask("wood") | io_family_mask("stone");
    const io_procedural even = {.seed = 5, .families = two},
                        more = {.seed = 5, .families = two, .often = io_family_mask("wood")},
                        both = {.seed = 5, .families = two, .often = two};
    enum { COUNT = 400 };
    const int half = drawn(&even, "wood", COUNT), most = drawn(&more, "wood", COUNT);
    CHECK(half > 160 && half < 240, "%d of %d are wood", half, COUNT);
    CHECK(most > 270 && most < 330, "%d of %d are wood, drawn three times as often", most, COUNT);
    CHECK(drawn(&both, "wood", COUNT) == half, "all three times as often is not the same as none");
}

TEST(procedural_other_relief_leaves_colours)
{
    enum { COUNT = 64, SIZE = 32 };
    const io_procedural plain = {.seed = 5}, other = {.seed = 5, .relief = 1}, half = {.seed = 5, .relief = 0.5f};
    int halves = 0, gloss = 0;
    double slopes[2] = {0, 0};
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&other, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        bool relief = false, rougher = false;
        for (int k = 0; k < SIZE * SIZE; k++) {
            const float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            CHECK(!memcmp(from + MAP_DIFFUSE, to + MAP_DIFFUSE, 3 * sizeof(float)) &&
                      !memcmp(from + MAP_SPECULAR, to + MAP_SPECULAR, 3 * sizeof(float)),
                  "material %d: diffuse or F0 changed with the relief", i);
            relief = relief || memcmp(from + MAP_NORMAL, to + MAP_NORMAL, 2 * sizeof(float)) != 0;
            rougher = rougher || from[MAP_ROUGHNESS] != to[MAP_ROUGHNESS];
            for (int v = 0; v < 2; v++) {
                const float n = to[MAP_NORMAL + v], was = from[MAP_NORMAL + v];
                CHECK(n > -1 && n < 1, "material %d: normal %g", i, (double)n);
                slopes[0] += (double)was * (double)was, slopes[1] += (double)n * (double)n;
            }
        }
        CHECK(relief || slopes[0] == 0, "material %d keeps its relief", i);
        gloss += rougher;
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
    CHECK(gloss > COUNT / 16 && gloss < COUNT / 2, "the roughness of %d of %d is another's", gloss, COUNT);
    /* what is broad stays in some, up to three times as steep */
    CHECK(slopes[1] > 0.5 * slopes[0] && slopes[1] < 3 * slopes[0], "relief %g in place of %g", sqrt(slopes[1]),
          sqrt(slopes[0]));
}

TEST(procedural_other_hues_change_diffuse_colours_alone)
{
    enum { COUNT = 48, SIZE = 16 };
    const io_procedural plain = {.seed = 5}, hued = {.seed = 5, .hues = 1}, half = {.seed = 5, .hues = 0.5f};
    int changed = 0, halves = 0, bluer = 0, before = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&hued, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        changed += memcmp(a.maps, b.maps, material_values(SIZE) * sizeof(float)) != 0;
        float blue[2] = {0, 0};
        for (int k = 0; k < SIZE * SIZE; k++) {
            const float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            CHECK(!memcmp(from + MAP_NORMAL, to + MAP_NORMAL, (MAP_CHANNELS - MAP_NORMAL) * sizeof(float)),
                  "material %d: F0, roughness or normals changed with the hues", i);
            for (int v = 0; v < 3; v++)
                CHECK(to[MAP_DIFFUSE + v] >= -1 && to[MAP_DIFFUSE + v] <= 0.9f, "material %d: diffuse %g", i,
                      (double)to[MAP_DIFFUSE + v]);
            blue[0] += from[MAP_DIFFUSE + 2] - from[MAP_DIFFUSE], blue[1] += to[MAP_DIFFUSE + 2] - to[MAP_DIFFUSE];
        }
        before += blue[0] > 0, bluer += blue[1] > 0;
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(changed > COUNT / 2 && halves > COUNT / 6 && halves < changed, "%d and %d of %d changed", changed, halves,
          COUNT);
    CHECK(bluer > before + COUNT / 8, "%d materials are more blue than red, %d before", bluer, before);
}

/* All eight planes of a canvas, at v[0] .. v[8 count - 1]. */
static io_canvas painted(int count, float *v)
{
    return (io_canvas){.count = count,
                       .height = v,
                       .diffuse = {v + count, v + 2 * count, v + 3 * count},
                       .specular = {v + 4 * count, v + 5 * count, v + 6 * count},
                       .roughness = v + 7 * count};
}

TEST(blends_are_weighted_means_of_all_maps)
{
    enum { COUNT = 5, ALL = CANVAS_PAINTED * COUNT };
    for (int w = 0; w <= 4; w++) {
        const float weight = (float)w / 4;
        float own[ALL], other[ALL], was[ALL];
        ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, (uint64_t)w);
        for (int i = 0; i < ALL; i++) was[i] = own[i] = ts_rng_uniform(&rng), other[i] = ts_rng_uniform(&rng);
        io_canvas c = painted(COUNT, own), o = painted(COUNT, other);
        cv_blend(&c, &o, weight);
        for (int i = 0; i < ALL; i++) {
            const float want = (1 - weight) * was[i] + weight * other[i];
            CHECK(fabsf(own[i] - want) < 1e-6f, "weight %g: value %d is %g, not %g", (double)weight, i, (double)own[i],
                  (double)want);
        }
    }
}

TEST(procedural_blends_are_a_share)
{
    enum { COUNT = 48, SIZE = 32 };
    const io_procedural plain = {.seed = 5}, blended = {.seed = 5, .blend = 1}, half = {.seed = 5, .blend = 0.5f};
    int halves = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&blended, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        bool changed[MAP_CHANNELS] = {false};
        for (size_t k = 0; k < material_values(SIZE); k++) {
            changed[k % MAP_CHANNELS] |= a.maps[k] != b.maps[k];
            CHECK(b.maps[k] >= -1 && b.maps[k] <= 1, "material %d: a value of %g", i, (double)b.maps[k]);
        }
        CHECK(changed[MAP_DIFFUSE] && changed[MAP_ROUGHNESS], "material %d is not blended", i);
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
}

/* Mean slope of the whole patch. */
static double patch_slope(const io_material *m)
{
    double sum[2] = {0};
    for (int i = 0; i < m->size * m->size; i++) {
        const float *n = m->maps + i * MAP_CHANNELS + MAP_NORMAL;
        const double z = sqrt(1 - (double)n[0] * n[0] - (double)n[1] * n[1]);
        for (int k = 0; k < 2; k++) sum[k] -= n[k] / z / (m->size * m->size);
    }
    return hypot(sum[0], sum[1]);
}

TEST(uneven_materials_lean_and_keep_their_colours)
{
    enum { COUNT = 64, SIZE = 64 };
    const io_procedural plain = {.seed = 5}, uneven = {.seed = 5, .uneven = 1}, half = {.seed = 5, .uneven = 0.5f};
    int halves = 0, steep = 0;
    double before = 0, after = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&uneven, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        const double slope = patch_slope(&b);
        before += patch_slope(&a) / COUNT;
        after += slope / COUNT;
        steep += slope > 0.1;
        CHECK(slope < 0.6, "material %d leans by %.3f", i, slope);
        for (int k = 0; k < SIZE * SIZE; k++) {
            const float *from = a.maps + k * MAP_CHANNELS, *to = b.maps + k * MAP_CHANNELS;
            for (int v = 0; v < MAP_CHANNELS; v++)
                CHECK(from[v] == to[v] || v == MAP_NORMAL || v == MAP_NORMAL + 1, "material %d: map value %d", i, v);
        }
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
    CHECK(after > 0.04 && after < 0.12 && after > 3 * before, "they lean by %.3f, flat ones by %.3f", after, before);
    CHECK(steep > COUNT / 12, "%d of %d lean by more than .1", steep, COUNT);
}

/* RMS of the sine waves of one period a patch in the logarithm of the green diffuse value, and of the whole. */
static double slow_waves(const io_material *m, double *all)
{
    double sum[4] = {0}, mean = 0, squares = 0;
    const int count = m->size * m->size;
    for (int i = 0; i < count; i++) {
        const double turn = 6.28318530718 / m->size, x = turn * (i % m->size + 0.5), y = turn * (i / m->size + 0.5);
        const double v = log(fmax((m->maps[i * MAP_CHANNELS + MAP_DIFFUSE + 1] + 1) / 2, 1e-3));
        sum[0] += v * sin(x), sum[1] += v * cos(x), sum[2] += v * sin(y), sum[3] += v * cos(y);
        mean += v / count, squares += v * v / count;
    }
    *all = sqrt(fmax(squares - mean * mean, 0));
    return sqrt(2 * (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2] + sum[3] * sum[3])) / count;
}

static void homogeneous(float closer)
{
    enum { COUNT = 96, SIZE = 64 };
    const io_procedural plain = {.seed = 5, .closer = closer}, same = {.seed = 5, .closer = closer, .homogeneous = 1},
                        half = {.seed = 5, .closer = closer, .homogeneous = 0.5f};
    int halves = 0, changed = 0;
    double slow[2] = {0}, deviation[2] = {0};
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&same, (uint64_t)i, &b);
        bool diffuse = false;
        for (int k = 0; k < SIZE * SIZE * MAP_CHANNELS; k++) {
            const int map = k % MAP_CHANNELS;
            const bool other = a.maps[k] != b.maps[k];
            diffuse = diffuse || (other && map == MAP_DIFFUSE + 1 && a.maps[k] > 2e-3f - 1);
            CHECK(!other || map < MAP_NORMAL || map == MAP_ROUGHNESS, "material %d: map value %d", i, map);
        }
        if (memcmp(a.maps, b.maps, material_values(SIZE) * sizeof(float))) halves += material_varies(&half, i, &a, &b);
        if (diffuse) {
            double all;
            changed++;
            slow[0] += slow_waves(&a, &all), deviation[0] += all;
            slow[1] += slow_waves(&b, &all), deviation[1] += all;
            CHECK(all > 0, "%s is one colour", a.name);
        }
        io_material_free(&a);
        io_material_free(&b);
    }
    CHECK(changed > COUNT / 3 && changed < COUNT, "%d of %d have other colours", changed, COUNT);
    CHECK(halves > changed / 4, "%d of %d at a share of a half", halves, changed);
    CHECK(slow[1] < 0.4 * slow[0], "slow waves of %g in place of %g", slow[1], slow[0]);
    CHECK(deviation[1] > 0.6 * deviation[0], "a deviation of %g in place of %g", deviation[1], deviation[0]);
}

/* Of what is seen, whether that is the whole patch or a part. */
TEST(homogeneous_materials_vary_in_their_details_alone)
{
    homogeneous(0);
    homogeneous(1);
}

/* Periods a patch of the strongest waves of the normals' x along rows and columns. */
static double strongest(const io_material *m)
{
    double most = 0, at = 0;
    for (int k = 1; k <= m->size / 4; k++) {
        double power = 0;
        for (int line = 0; line < 2 * m->size; line++) {
            double re = 0, im = 0;
            for (int i = 0; i < m->size; i++) {
                const int pixel = line < m->size ? line * m->size + i : i * m->size + line - m->size;
                const double v = m->maps[pixel * MAP_CHANNELS + MAP_NORMAL], turn = 6.28318530718 * k * i / m->size;
                re += v * cos(turn), im += v * sin(turn);
            }
            power += re * re + im * im;
        }
        if (power > most) most = power, at = k;
    }
    return at;
}

TEST(closer_materials_are_of_larger_parts)
{
    enum { COUNT = 64, SIZE = 64 };
    const uint64_t built = io_family_mask("masonry") | io_family_mask("cobbles") | io_family_mask("scales");
    const io_procedural plain = {.seed = 5, .families = built}, near = {.seed = 5, .families = built, .closer = 1},
                        half = {.seed = 5, .families = built, .closer = 0.5f};
    int halves = 0;
    double periods[2] = {0};
    for (int i = 0; i < COUNT; i++) {
        io_material a = new_material(SIZE), b = new_material(SIZE);
        io_procedural_make(&plain, (uint64_t)i, &a);
        io_procedural_make(&near, (uint64_t)i, &b);
        halves += material_varies(&half, i, &a, &b);
        periods[0] += log(strongest(&a)) / COUNT;
        periods[1] += log(strongest(&b)) / COUNT;
        io_material_free(&a);
        io_material_free(&b);
    }
    const double times = exp(periods[0] - periods[1]);
    CHECK(halves > COUNT / 4 && halves < 3 * COUNT / 4, "%d of %d at a share of a half", halves, COUNT);
    CHECK(times > 1.4 && times < 2.6, "parts are %.2f times as large; the mean of the logarithm is that of 2", times);
}
