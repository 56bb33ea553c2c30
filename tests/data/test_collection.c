/* Materials that are parts of map sets. */
#include "data/collection.h"
#include "data/height.h"
#include "data/loader.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>
#include <sys/stat.h>

enum { SIDE = 128, SIZE = 128 };
#define TURN 6.283185307179586f

static void folder_of(const char *name, char path[512])
{
    snprintf(path, 512, "%s/%s", test_folder(), name);
    CHECK(!mkdir(path, 0700), "mkdir %s", path);
}

/* A set in the test's folder/of: dielectric, with waves of so many periods a side, so steep, that run along the
 * diagonal; brighter by glow where they are high. */
static void write_set(const char *of, const char *name, float roughness, int periods, float steep, float glow)
{
    ts_status st = {0};
    char path[512], both[300];
    io_material m;
    snprintf(both, sizeof both, "%s/%s", of, name);
    folder_of(both, path);
    CHECK(io_material_create(&m, SIDE, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const float along = ((float)(i % SIDE + i / SIDE) + 1) / SIDE, phase = TURN * (float)periods * along;
        const float slope = steep * cosf(phase), more = glow * sinf(phase); /* along x and down; high where sin is 1 */
        const io_texel t = {.diffuse = {0.5f + more, 0.3f + more, 0.2f + more},
                            .specular = {0.04f, 0.04f, 0.04f},
                            .roughness = roughness,
                            .normal = {-slope, slope, 1}};
        io_texel_put(m.maps + (size_t)i * MAP_CHANNELS, &t);
    }
    CHECK(io_write_maps(path, &m, IO_MAPS_ALL & ~IO_MAPS_EXR, false, &st) == TS_OK, "%s", st.message);
    io_material_free(&m);
}

static io_collection *read_collection(const char *of)
{
    ts_status st = {0};
    char path[512];
    snprintf(path, sizeof path, "%s/%s", test_folder(), of);
    io_collection *c = io_collection_read(path, 1, NULL, NULL, &st);
    CHECK(c, "%s", st.message);
    return c;
}

TEST(collected_material_keeps_colours_and_slopes_of_its_set)
{
    char path[512];
    folder_of("sets", path);
    write_set("sets", "waves", 0.6f, 6, 0.25f, 0);
    io_collection *collection = read_collection("sets");
    CHECK(io_collection_count(collection) == 1, "%d sets", io_collection_count(collection));
    const io_procedural p = {.seed = 3, .collection = collection, .collected = 1};
    static float maps[SIZE * SIZE * MAP_CHANNELS];
    io_material m = {.size = SIZE, .maps = maps};
    int same_gloss = 0;
    for (uint64_t index = 0; index < 24; index++) {
        io_procedural_make(&p, index, &m);
        CHECK(strstr(m.name, "collected_0"), "%s", m.name);
        double slope = 0, f0 = 0, roughness = 0;
        for (int i = 0; i < SIZE * SIZE; i++) {
            const io_texel t = io_texel_get(maps + i * MAP_CHANNELS);
            CHECK(fabsf(t.diffuse[0] - 0.5f) < 0.01f && fabsf(t.diffuse[2] - 0.2f) < 0.01f, "a colour changed");
            slope += (double)((t.normal[0] * t.normal[0] + t.normal[1] * t.normal[1]) / (t.normal[2] * t.normal[2]));
            f0 += (double)t.specular[1] / (SIZE * SIZE);
            roughness += (double)t.roughness / (SIZE * SIZE);
        }
        /* However much of it is seen, and turned however. */
        CHECK(fabs(sqrt(slope / (SIZE * SIZE)) - 0.25) < 0.03, "material %d has a slope of %g", (int)index,
              sqrt(slope / (SIZE * SIZE)));
        const bool own = fabs(f0 - 0.04) < 0.001 && fabs(roughness - 0.6) < 0.005;
        same_gloss += own;
        CHECK(f0 > 0.019 && f0 < 0.081 && roughness > 0.29, "F0 %g, roughness %g", f0, roughness);
    }
    CHECK(same_gloss > 4 && same_gloss < 20, "%d of 24 keep their gloss", same_gloss);
    io_collection_free(&collection);
    CHECK(!collection, "free leaves the pointer");
}

/* Neither turned nor mirrored does a hill become a hollow. */
TEST(collected_material_keeps_hills_and_their_colours_together)
{
    ts_status st = {0};
    char path[512];
    folder_of("hills", path);
    write_set("hills", "bright", 0.6f, 5, 0.2f, 0.1f);
    io_collection *collection = read_collection("hills");
    const io_procedural p = {.seed = 5, .collection = collection, .collected = 1};
    static float maps[SIZE * SIZE * MAP_CHANNELS], height[SIZE * SIZE];
    io_material m = {.size = SIZE, .maps = maps};
    for (uint64_t index = 0; index < 12; index++) {
        io_procedural_make(&p, index, &m);
        CHECK(io_height(&m, false, height, 1, &st) == TS_OK, "%s", st.message);
        double product = 0, colour = 0, relief = 0, mean = 0;
        for (int i = 0; i < SIZE * SIZE; i++)
            mean += (double)io_texel_get(maps + i * MAP_CHANNELS).diffuse[1] / (SIZE * SIZE);
        for (int i = 0; i < SIZE * SIZE; i++) {
            const double x = (double)io_texel_get(maps + i * MAP_CHANNELS).diffuse[1] - mean, y = (double)height[i];
            product += x * y;
            colour += x * x;
            relief += y * y;
        }
        CHECK(product > 0.95 * sqrt(colour * relief), "material %d: %g", (int)index, product / sqrt(colour * relief));
    }
    io_collection_free(&collection);
}

TEST(collected_share_is_kept_and_the_other_materials_stay)
{
    char path[512];
    folder_of("two", path);
    write_set("two", "a", 0.3f, 4, 0.1f, 0);
    write_set("two", "b", 0.7f, 4, 0.1f, 0);
    io_collection *collection = read_collection("two");
    const io_procedural plain = {.seed = 9, .hues = 0.5f, .blend = 0.5f};
    io_procedural p = plain;
    p.collection = collection;
    p.collected = 0.4f;
    enum { VALUES = 16 * 16 * MAP_CHANNELS };
    float with[VALUES], without[VALUES];
    io_material a = {.size = 16, .maps = with}, b = {.size = 16, .maps = without};
    int collected = 0, of[2] = {0};
    for (uint64_t index = 0; index < 200; index++) {
        io_procedural_make(&p, index, &a);
        io_procedural_make(&plain, index, &b);
        const bool taken = strstr(a.name, "collected");
        collected += taken;
        if (taken) of[a.name[strlen(a.name) - 1] == '1']++;
        else CHECK(!memcmp(with, without, sizeof with) && !strcmp(a.name, b.name), "material %d", (int)index);
    }
    CHECK(collected > 55 && collected < 105 && of[0] > 15 && of[1] > 15, "%d, %d and %d of 200", collected, of[0],
          of[1]);
    ts_status st = {0};
    io_loader *l = io_loader_create(&p, 16, (io_share){5, 0, 5}, 0, 2, 3, &st);
    CHECK(l, "%s", st.message);
    for (uint64_t i = 0; i < 20; i += 5) {
        const float *maps = io_loader_next(l, &st);
        for (uint64_t k = 0; k < 5; k++) {
            io_procedural_make(&p, i + k, &a);
            CHECK(!memcmp(maps + k * VALUES, with, sizeof with), "material %d", (int)(i + k));
        }
    }
    io_loader_destroy(&l);
    io_collection_free(&collection);
}

TEST(collection_names_what_it_cannot_read)
{
    ts_status st = {0};
    char path[512], set[600];
    folder_of("bad", path);
    CHECK(!io_collection_read(path, 1, NULL, NULL, &st) && strstr(st.message, "no folders in it"), "%s", st.message);
    write_set("bad", "good", 0.5f, 2, 0.1f, 0);
    folder_of("bad/wanting", set);
    CHECK(!io_collection_read(path, 1, NULL, NULL, &st) && strstr(st.message, "wanting") && st.code == TS_INVALID, "%s",
          st.message);
    snprintf(path, sizeof path, "%s/nowhere", test_folder());
    CHECK(!io_collection_read(path, 1, NULL, NULL, &st) && strstr(st.message, "nowhere") && st.code == TS_IO, "%s",
          st.message);
}

static bool after_one(void *calls) { return ++*(int *)calls > 1; }

TEST(collection_stops_where_it_is_asked_to)
{
    ts_status st = {0};
    char path[512];
    int calls = 0;
    folder_of("stopped", path);
    for (int i = 0; i < 3; i++) write_set("stopped", (const char *[]){"a", "b", "c"}[i], 0.5f, 2, 0.1f, 0);
    CHECK(!io_collection_read(path, 1, after_one, &calls, &st) && st.code == TS_INTERRUPTED && calls == 2,
          "%d calls: %s", calls, st.message);
}
