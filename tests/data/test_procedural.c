/* Procedural materials and their statistics. */
#include "data/materials/noise.h"
#include "data/materials/procedural.h"
#include "data/materials/statistics.h"
#include "tensor/team.h"
#include "tests/data/new_material.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t values(int size) { return (size_t)size * (size_t)size * MAP_CHANNELS; }

TEST(procedural_families_are_named)
{
    CHECK(io_family_count() >= 10 && io_family_count() < 64, "%d families", io_family_count());
    for (int i = 0; i < io_family_count(); i++)
        CHECK(io_family_find(io_family_name(i)) == i, "family %d is not found by its name %s", i, io_family_name(i));
    CHECK(io_family_find("velociraptor") == -1 && io_family_find("") == -1, "a name that is none was found");
}

typedef struct making {
    const io_procedural *p;
    int size, count;
    float *to;
} making;

/* Another order, other threads, other sizes between. */
static void make_after_another(const void *job, int64_t task)
{
    const making *j = job;
    const int i = j->count - 1 - (int)task;
    io_material other = new_material(8 + 4 * i), m = {.size = j->size, .maps = j->to + (size_t)i * values(j->size)};
    io_procedural_make(j->p, (uint64_t)(7 * i), &other);
    io_procedural_make(j->p, (uint64_t)i, &m);
    io_material_free(&other);
}

TEST(procedural_bytes_depend_on_seed_and_index_alone)
{
    enum { COUNT = 24, SIZE = 32 };
    io_procedural p = {.seed = 5};
    float *forward = malloc(COUNT * values(SIZE) * sizeof *forward),
          *parallel = malloc(COUNT * values(SIZE) * sizeof *parallel);
    for (int i = 0; i < COUNT; i++) {
        io_material m = {.size = SIZE, .maps = forward + (size_t)i * values(SIZE)};
        io_procedural_make(&p, (uint64_t)i, &m);
    }
    ts_tasks(3, COUNT, make_after_another, &(making){&p, SIZE, COUNT, parallel});
    CHECK(!memcmp(forward, parallel, COUNT * values(SIZE) * sizeof *forward), "the bytes depend on threads or order");
    for (int i = 1; i < COUNT; i++)
        CHECK(memcmp(forward, forward + (size_t)i * values(SIZE), values(SIZE) * sizeof *forward),
              "materials 0 and %d are the same", i);
    io_procedural q = {.seed = 6};
    io_material m = {.size = SIZE, .maps = parallel};
    io_procedural_make(&q, 0, &m);
    CHECK(memcmp(forward, parallel, values(SIZE) * sizeof *forward), "two seeds give the same material");
    free(forward);
    free(parallel);
}

TEST(procedural_values_are_in_range)
{
    static const int sizes[] = {1, 2, 7, 48, 64, 97};
    for (int f = 0; f < io_family_count(); f++)
        for (int k = 0; k < 30; k++) {
            int size = sizes[k % 6];
            io_material m = new_material(size);
            io_procedural p = {.seed = 2, .families = UINT64_C(1) << f};
            io_procedural_make(&p, (uint64_t)k, &m);
            for (int i = 0; i < size * size; i++) {
                const float *v = m.maps + (size_t)i * MAP_CHANNELS;
                for (int c = 0; c < MAP_CHANNELS; c++)
                    CHECK(isfinite(v[c]) && fabsf(v[c]) <= 1, "%s at %d: channel %d of pixel %d is %g", m.name, size, c,
                          i, v[c]);
                float flat = v[MAP_NORMAL] * v[MAP_NORMAL] + v[MAP_NORMAL + 1] * v[MAP_NORMAL + 1];
                CHECK(flat < 0.9f, "%s at %d: a normal is as good as lying, n_xy^2 = %g", m.name, size, flat);
                CHECK(v[MAP_ROUGHNESS] >= 2 * 0.03f - 1.001f, "%s: roughness %g", m.name,
                      0.5f * v[MAP_ROUGHNESS] + 0.5f);
                for (int c = 0; c < 3; c++)
                    CHECK(v[MAP_SPECULAR + c] >= 2 * 0.01f - 1.001f, "%s: F0 %g", m.name,
                          0.5f * v[MAP_SPECULAR + c] + 0.5f);
            }
            io_material_free(&m);
        }
}

/* Every branch of every family: none runs out of scratch planes (an assertion), none leaves a value out. */
TEST(procedural_many_materials_of_every_family)
{
    io_material m = new_material(3);
    for (int f = 0; f < io_family_count(); f++)
        for (uint64_t i = 0; i < 1500; i++) {
            io_procedural p = {.seed = 7, .families = UINT64_C(1) << f};
            io_procedural_make(&p, i, &m);
            for (size_t k = 0; k < values(3); k++)
                CHECK(isfinite(m.maps[k]) && fabsf(m.maps[k]) <= 1, "%s: value %g", m.name, m.maps[k]);
        }
    io_material_free(&m);
}

TEST(procedural_family_mask_is_respected)
{
    io_material m = new_material(8);
    int wood = io_family_find("wood"), rust = io_family_find("rust"), seen[2] = {0, 0};
    CHECK(wood >= 0 && rust >= 0, "wood and rust are families");
    for (int f = 0; f < io_family_count(); f++) {
        io_procedural p = {.seed = 1, .families = UINT64_C(1) << f};
        for (uint64_t i = 0; i < 20; i++) {
            io_procedural_make(&p, i, &m);
            for (int other = 0; other < io_family_count(); other++) {
                char key[64];
                snprintf(key, sizeof key, "_%s", io_family_name(other));
                CHECK(other == f || !strstr(m.name, key), "only %s was allowed, but %s came", io_family_name(f),
                      m.name);
            }
        }
    }
    io_procedural p = {.seed = 1, .families = UINT64_C(1) << wood | UINT64_C(1) << rust};
    for (uint64_t i = 0; i < 60; i++) {
        io_procedural_make(&p, i, &m);
        seen[0] += strstr(m.name, "wood") != NULL;
        seen[1] += strstr(m.name, "rust") != NULL;
        CHECK(strstr(m.name, "wood") || strstr(m.name, "rust"), "%s is neither wood nor rust", m.name);
    }
    CHECK(seen[0] > 5 && seen[1] > 5, "of 60, %d wood and %d rust", seen[0], seen[1]);
    io_material_free(&m);
}

/* What is measured on the classic families stays comparable while others are added. */
TEST(procedural_classic_families_stay)
{
    static const char *const names[] = {
        "00000_paving_panels", "00001_marble", "00002_concrete",     "00003_embossed", "00004_stone",
        "00005_leather",       "00006_stone",  "00007_ground_cloth", "00008_leather",  "00009_leather",
        "00010_leather",       "00011_rust",   "00012_stone",        "00013_marble",   "00014_embossed_leather",
        "00015_embossed"};
    static const double means[] = {-0.585629, -0.652200, -0.349389, -0.588958, -0.608256, -0.683954,
                                   -0.668373, -0.452797, -0.598985, -0.666903, -0.652926, -0.565165,
                                   -0.373751, -0.667716, -0.454003, -0.429447};
    io_material m = new_material(32);
    const io_procedural p = {.seed = 1000003, .families = io_family_mask("classic")};
    for (int i = 0; i < 16; i++) {
        double sum = 0;
        io_procedural_make(&p, (uint64_t)i, &m);
        for (size_t k = 0; k < values(32); k++) sum += m.maps[k];
        CHECK(!strcmp(m.name, names[i]), "material %d was %s and is %s", i, names[i], m.name);
        CHECK(fabs(sum / (double)values(32) - means[i]) < 2e-5, "%s: mean %.6f", m.name, sum / (double)values(32));
    }
    io_material_free(&m);
}

/* The mean over each family's materials lies nearer to that family than chance: families are not one soup. */
TEST(procedural_families_differ)
{
    enum { COUNT = 24, SIZE = 48 };
    int n = io_family_count(), apart = 0, pairs = 0;
    io_feature_set *set = calloc((size_t)n, sizeof *set);
    for (int f = 0; f < n; f++) {
        io_procedural p = {.seed = 3, .families = UINT64_C(1) << f};
        CHECK(io_features_procedural(&p, 0, COUNT, SIZE, &set[f], NULL) == TS_OK, "no features of %s",
              io_family_name(f));
    }
    double own = 0;
    for (int f = 0; f < n; f++) own += io_feature_halves(&set[f], 10, 1) / n;
    for (int f = 0; f < n; f++)
        for (int g = 0; g < f; g++) {
            pairs++;
            apart += io_feature_distance(&set[f], &set[g], NULL) > own;
        }
    CHECK(apart > 0.9 * pairs, "only %d of %d pairs of families are farther apart than halves of one family (%.2f)",
          apart, pairs, own);
    for (int f = 0; f < n; f++) io_feature_set_free(&set[f]);
    free(set);
}

/* A material is the same thing at every size: 96 pixels are 192 averaged, but for the detail between. */
TEST(procedural_sizes_agree)
{
    enum { SMALL = 96, LARGE = 192 };
    const int count = io_family_count();
    io_material a = new_material(SMALL), b = new_material(LARGE), c = new_material(SMALL);
    double same = 0, other = 0;
    for (uint64_t i = 0; i < (uint64_t)count; i++) {
        io_procedural p = {.seed = 4, .families = UINT64_C(1) << i};
        io_procedural_make(&p, i, &a);
        io_procedural_make(&p, i, &b);
        io_procedural_make(&p, i + 1000, &c);
        for (int y = 0; y < SMALL; y++)
            for (int x = 0; x < SMALL; x++)
                for (int k = 0; k < MAP_CHANNELS; k++) {
                    const float *v = b.maps + ((size_t)(2 * y) * LARGE + (size_t)(2 * x)) * MAP_CHANNELS + k;
                    float mean = 0.25f *
                        (v[0] + v[MAP_CHANNELS] + v[LARGE * MAP_CHANNELS] + v[(LARGE + 1) * MAP_CHANNELS]);
                    size_t at = ((size_t)y * SMALL + (size_t)x) * MAP_CHANNELS + (size_t)k;
                    same += (a.maps[at] - mean) * (a.maps[at] - mean);
                    other += (c.maps[at] - mean) * (c.maps[at] - mean);
                }
    }
    same = sqrt(same / (count * (double)values(SMALL)));
    other = sqrt(other / (count * (double)values(SMALL)));
    CHECK(same < 0.08 && same < 0.25 * other, "RMSE %.3f between sizes, %.3f between materials", same, other);
    io_material_free(&a);
    io_material_free(&b);
    io_material_free(&c);
}

TEST(procedural_covers_what_materials_are)
{
    enum { COUNT = 300, SIZE = 24 };
    int metals = 0, dark = 0, light = 0, smooth = 0, rough = 0, flat = 0, deep = 0;
    io_procedural p = {.seed = 1};
    io_feature_set set;
    CHECK(io_features_procedural(&p, 0, COUNT, SIZE, &set, NULL) == TS_OK, "no features");
    for (int i = 0; i < COUNT; i++) {
        const double *v = set.values[i]; /* the order of io_feature_name */
        metals += v[19] > 0.3;
        dark += v[0] < 0.2;
        light += v[0] > 0.6;
        smooth += v[1] < 0.25;
        rough += v[1] > 0.7;
        flat += v[3] < 0.02;
        deep += v[3] > 0.25;
    }
    CHECK(!strcmp(io_feature_name(19), "metal") && !strcmp(io_feature_name(3), "mean slope"),
          "the features are in another order");
    CHECK(metals > 0.1 * COUNT && metals < 0.4 * COUNT, "%d of %d are metals", metals, COUNT);
    CHECK(dark > 0.05 * COUNT && light > 0.04 * COUNT, "%d dark and %d light of %d", dark, light, COUNT);
    CHECK(smooth > 0.05 * COUNT && rough > 0.05 * COUNT, "%d smooth and %d rough of %d", smooth, rough, COUNT);
    CHECK(flat > 0.05 * COUNT && deep > 0.02 * COUNT, "%d flat and %d deep of %d", flat, deep, COUNT);
    io_feature_set_free(&set);
}

TEST(procedural_statistics_resemble_artists_maps)
{
    enum { SIZE = 64 };
    const char *folder = test_data();
    ts_status st = {0};
    io_feature_set theirs, ours;
    io_procedural p = {.seed = 1};
    CHECK(io_features_folder(folder, SIZE, &theirs, &st) == TS_OK, "%s", st.message);
    CHECK(io_features_procedural(&p, 0, 200, SIZE, &ours, &st) == TS_OK, "%s", st.message);
    double distance = io_feature_distance(&ours, &theirs, NULL), halves = io_feature_halves(&theirs, 100, 1);
    CHECK(distance <= 2 * halves, "distance %.3f, more than twice the %.3f between halves of %s", distance, halves,
          folder);
    io_feature_set_free(&ours);
    io_feature_set_free(&theirs);
}

TEST(statistics_measure_what_they_say)
{
    enum { SIZE = 32 };
    io_material m = new_material(SIZE);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++) { /* left half smooth metal, right half rough and grey, tilted by 0.6 */
            bool right = x >= SIZE / 2;
            float d = right ? 0.25f : 0, s = right ? 0.04f : 0.5f;
            io_texel t = {{d, d, d}, {right ? 0.6f : 0, 0, right ? 0.8f : 1}, right ? 0.75f : 0.25f, {s, s, s}};
            io_texel_put(m.maps + (size_t)(y * SIZE + x) * MAP_CHANNELS, &t);
        }
    double f[IO_FEATURES];
    ts_status st = {0};
    CHECK(!io_features(m.maps, SIZE, f, &st), "%s", st.message);
    CHECK(fabs(f[0] - 0.5 * pow(0.25, 1 / 2.2)) < 1e-5 && fabs(f[1] - 0.5) < 1e-6 && fabs(f[3] - 0.3) < 1e-6,
          "means %g %g %g", f[0], f[1], f[3]);
    CHECK(fabs(f[5] - 0.25) < 1e-6 && fabs(f[7] - 0.3) < 1e-6, "spreads %g %g", f[5], f[7]);
    CHECK(fabs(f[9] - 0.5 / (SIZE - 1) * SIZE / 64) < 1e-6, "gradient of roughness %g", f[9]);
    CHECK(fabs(f[12] - 1) < 1e-5 && fabs(f[13] + 1) < 1e-5 && fabs(f[16] - 1) < 1e-5, "correlations %g %g %g", f[12],
          f[13], f[16]);
    CHECK(f[18] < 1e-4 && fabs(f[19] - 0.5) < 1e-6, "saturation %g, metal %g", f[18], f[19]);
    io_material_free(&m);
    double rows[4][IO_FEATURES] = {{0}};
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < IO_FEATURES; k++)
            rows[i][k] = i < 2 ? i : i + 3; /* 0 1 and 5 6: means 5 apart, deviations 0.5 */
    io_feature_set a = {2, rows}, b = {2, rows + 2}, all = {4, rows};
    CHECK(io_feature_distance(&a, &a, NULL) == 0 && fabs(io_feature_distance(&a, &b, NULL) - 10) < 1e-9, "distance %g",
          io_feature_distance(&a, &b, NULL));
    CHECK(io_feature_halves(&all, 20, 1) == io_feature_halves(&all, 20, 1) && io_feature_halves(&all, 20, 1) > 0,
          "halvings");
}

TEST(noise_has_unit_spread_and_no_detail_below_a_pixel)
{
    enum { SIDE = 256 };
    float *u = malloc(SIDE * SIDE * sizeof *u), *v = malloc(SIDE * SIDE * sizeof *v),
          *out = malloc(SIDE * SIDE * sizeof *out);
    for (int i = 0; i < SIDE * SIDE; i++) {
        u[i] = (float)(i % SIDE) * 0.31f - 40; /* negative lattice numbers too */
        v[i] = (float)(i / SIDE) * 0.31f - 40;
    }
    for (int kind = NZ_SMOOTH; kind <= NZ_BILLOW; kind++)
        for (int octaves = 1; octaves <= 4; octaves += 3) {
            nz_frame f = {SIDE * SIDE, u, v, 1e-6f};
            double sum = 0, squares = 0;
            nz_fbm(f, (nz_kind)kind, 1, octaves, 0.5f, 9, out);
            for (int i = 0; i < f.count; i++) {
                sum += out[i];
                squares += (double)out[i] * out[i];
            }
            double mean = sum / f.count, deviation = sqrt(squares / f.count - mean * mean);
            CHECK(fabs(mean) < 0.15 && fabs(deviation - 1) < 0.15, "kind %d, %d octaves: mean %.3f, deviation %.3f",
                  kind, octaves, mean, deviation);
        }
    nz_frame coarse = {SIDE * SIDE, u, v, 0.7f};
    nz_fbm(coarse, NZ_SMOOTH, 1, 5, 0.5f, 9, out);
    for (int i = 0; i < coarse.count; i++) CHECK(out[i] == 0, "noise finer than a pixel");
    nz_cells cells = {.near = u, .edge = v, .id = out};
    float *x = malloc(SIDE * SIDE * sizeof *x), *y = malloc(SIDE * SIDE * sizeof *y);
    for (int i = 0; i < SIDE * SIDE; i++) {
        x[i] = (float)(i % SIDE) * 0.07f;
        y[i] = (float)(i / SIDE) * 0.07f;
    }
    nz_cell((nz_frame){SIDE * SIDE, x, y, 0.07f}, 1, 0, 0, 3, cells); /* without jitter: squares */
    for (int i = 0; i < SIDE * SIDE; i++) {
        float fx = x[i] - floorf(x[i]), fy = y[i] - floorf(y[i]), edge = fminf(fminf(fx, 1 - fx), fminf(fy, 1 - fy));
        CHECK(fabsf(v[i] - edge) < 1e-4f && fabsf(u[i] - hypotf(fx - 0.5f, fy - 0.5f)) < 1e-4f,
              "cell at %g %g: near %g edge %g", x[i], y[i], u[i], v[i]);
    }
    for (int i = 0; i < SIDE * SIDE; i++) x[i] = 3;
    nz_blur(SIDE, 5, x, out, y);
    for (int i = 0; i < SIDE * SIDE; i++) CHECK(fabsf(out[i] - 3) < 1e-4f, "a blurred constant is %g", out[i]);
    free(u), free(v), free(out), free(x), free(y);
}
