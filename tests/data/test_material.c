/* Maps in memory, maps.exr, strips, and what lgd writes. */
#include "data/file.h"
#include "data/image/exr.h"
#include "data/material.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static float uniform(unsigned *state)
{
    *state = *state * 1664525 + 1013904223;
    return (float)(*state >> 8) / (1 << 24);
}

static io_material random_material(int size, unsigned seed)
{
    ts_status st = {0};
    io_material m;
    CHECK(io_material_create(&m, size, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < size * size; i++) {
        io_texel t = {.roughness = uniform(&seed),
                      .normal = {uniform(&seed) - 0.5f, uniform(&seed) - 0.5f, 0.2f + uniform(&seed)}};
        for (int c = 0; c < 3; c++) t.diffuse[c] = uniform(&seed), t.specular[c] = uniform(&seed);
        io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    }
    return m;
}

static void check_unit(const float *n, const char *what)
{
    float s = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    CHECK(fabsf(s - 1) < 1e-5f && n[2] > 0, "%s: normal %g %g %g", what, (double)n[0], (double)n[1], (double)n[2]);
}

TEST(texel_round_trip)
{
    io_material m = random_material(32, 1);
    for (int i = 0; i < 32 * 32; i++) {
        float again[MAP_CHANNELS], *maps = m.maps + i * MAP_CHANNELS;
        io_texel t = io_texel_get(maps);
        check_unit(t.normal, "round trip");
        io_texel_put(again, &t);
        CHECK(again[MAP_NORMAL] == maps[MAP_NORMAL] && again[MAP_NORMAL + 1] == maps[MAP_NORMAL + 1],
              "the normal changed at %d", i);
        for (int c = 0; c < MAP_CHANNELS; c++)
            CHECK(fabsf(again[c] - maps[c]) < 1e-6f, "channel %d: %g became %g", c, (double)maps[c], (double)again[c]);
    }
    io_material_free(&m);
}

/* Whatever the maps hold, a texel is a material: values in [0, 1] and a unit normal above the surface. */
TEST(texel_of_anything)
{
    static const float odd[] = {0,      -0.0f,  1,   -1,       2,         -2,        1e30f,
                                -1e30f, 1e-40f, NAN, INFINITY, -INFINITY, 0.999999f, 0.70710678f};
    enum { ODD = sizeof odd / sizeof odd[0] };
    for (int a = 0; a < ODD; a++)
        for (int b = 0; b < ODD; b++) {
            float maps[MAP_CHANNELS];
            for (int c = 0; c < MAP_CHANNELS; c++) maps[c] = odd[(c & 1) ? a : b];
            io_texel t = io_texel_get(maps);
            check_unit(t.normal, "odd maps");
            for (int c = 0; c < 3; c++)
                CHECK(t.diffuse[c] >= 0 && t.diffuse[c] <= 1 && t.specular[c] >= 0 && t.specular[c] <= 1,
                      "%g and %g give %g %g", (double)odd[a], (double)odd[b], (double)t.diffuse[c],
                      (double)t.specular[c]);
            CHECK(t.roughness >= 0 && t.roughness <= 1, "roughness %g", (double)t.roughness);
            io_texel u = {{odd[a], odd[b], 0.5f}, {odd[a], odd[b], 0.1f}, odd[a], {odd[b], odd[a], 0}};
            io_texel_put(maps, &u);
            for (int c = 0; c < MAP_CHANNELS; c++)
                CHECK(maps[c] >= -1 && maps[c] <= 1, "channel %d is %g", c, (double)maps[c]);
        }
}

TEST(maps_exr_is_exact)
{
    char path[2][512];
    ts_status st = {0};
    static const int sizes[] = {1, 15, 16, 17, 67};
    for (int k = 0; k < 5; k++) {
        io_material m = random_material(sizes[k], 5), back, again;
        for (int i = 0; i < 2; i++) snprintf(path[i], sizeof path[i], "%s/%d.exr", test_folder(), i);
        CHECK(io_write_maps_exr(path[0], &m, k & 1, false, 0, &st) == TS_OK, "%s", st.message);
        CHECK(io_read_maps_exr(path[0], &back, &st) == TS_OK, "%s", st.message);
        CHECK(back.size == sizes[k], "size %d", back.size);
        for (int i = 0; i < m.size * m.size * MAP_CHANNELS; i++)
            CHECK(fabsf(m.maps[i] - back.maps[i]) < 1e-6f, "value %d: %g became %g", i, (double)m.maps[i],
                  (double)back.maps[i]);
        /* The file is the truth: from it on, every bit stays. */
        CHECK(io_write_maps_exr(path[1], &back, false, false, 0, &st) == TS_OK &&
                  io_read_maps_exr(path[1], &again, &st) == TS_OK,
              "%s", st.message);
        CHECK(!memcmp(back.maps, again.maps, (size_t)m.size * (size_t)m.size * MAP_CHANNELS * sizeof(float)),
              "maps changed on the second way");
        io_material_free(&m), io_material_free(&back), io_material_free(&again);
        CHECK(!back.maps && !back.size, "free leaves something");
    }
}

/* Compressed by several threads: the same bytes, and what is read is the half float of each value. */
TEST(maps_exr_of_half_floats)
{
    char path[2][512];
    ts_status st = {0};
    static const int sizes[] = {1, 16, 37, 200};
    for (int i = 0; i < 2; i++) snprintf(path[i], sizeof path[i], "%s/%d.exr", test_folder(), i);
    for (int k = 0; k < 4; k++) {
        io_material m = random_material(sizes[k], 6), back;
        for (int i = 0; i < 2; i++)
            CHECK(io_write_maps_exr(path[i], &m, false, true, i ? 3 : 1, &st) == TS_OK, "%s", st.message);
        bytes one = bytes_load(path[0]), three = bytes_load(path[1]);
        CHECK(one.size == three.size && !memcmp(one.data, three.data, one.size), "threads change the bytes");
        CHECK(one.size < 3000 + (size_t)(sizes[k] * sizes[k]) * 26, "%zu bytes", one.size);
        bytes_free(&one), bytes_free(&three);
        CHECK(io_read_maps_exr(path[1], &back, &st) == TS_OK && back.size == sizes[k], "%s", st.message);
        for (int i = 0; i < m.size * m.size * MAP_CHANNELS; i++)
            CHECK(fabsf(m.maps[i] - back.maps[i]) < 1.5e-3f, "%d pixels, value %d: %g became %g", sizes[k], i,
                  (double)m.maps[i], (double)back.maps[i]);
        io_material_free(&m), io_material_free(&back);
    }
    io_material m = random_material(40, 6);
    CHECK(io_write_maps_exr("/dev/full", &m, false, true, 3, &st) == TS_IO && strstr(st.message, "/dev/full"), "%s",
          st.message);
    io_material_free(&m);
}

/* Other programs see the channels by name: OpenImageIO, an independent reader of the file, finds red before green
 * before blue. */
TEST(maps_exr_channel_values)
{
    ts_status st = {0};
    io_material m;
    io_image seen;
    char path[512];
    CHECK(io_material_create(&m, 20, &st) == TS_OK, "%s", st.message);
    const io_texel t = {{0.1f, 0.2f, 0.3f}, {0.6f, 0, 0.8f}, 0.4f, {0.5f, 0.6f, 0.7f}};
    for (int i = 0; i < 400; i++) io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    snprintf(path, sizeof path, "%s/maps.exr", test_folder());
    CHECK(io_write_maps_exr(path, &m, true, false, 0, &st) == TS_OK, "%s", st.message);
    bytes b = bytes_load(path);
    static const char *const names[] = {"diffuse.R", "diffuse.G", "diffuse.B",   "normal.X",
                                        "normal.Y",  "normal.Z",  "roughness.Y", "specular.R"};
    for (int i = 0; i < 8; i++)
        CHECK(memmem(b.data, b.size, names[i], strlen(names[i]) + 1), "no channel %s", names[i]);
    bytes_free(&b);
    CHECK(io_read_data(path, 3, IO_MAX_PIXELS_DEFAULT, &seen, &st) == TS_OK, "%s", st.message);
    CHECK(seen.width == 20 && seen.height == 20, "%d x %d", seen.width, seen.height);
    for (int c = 0; c < 3; c++)
        CHECK(fabsf(seen.data[300 + c] - t.diffuse[c]) < 1e-6f,
              "the first three channels are %g %g %g, not the diffuse", (double)seen.data[300], (double)seen.data[301],
              (double)seen.data[302]);
}

static void exr_refused(const char *path, const char *word)
{
    ts_status st = {0};
    io_material m;
    CHECK(io_read_maps_exr(path, &m, &st) != TS_OK && !m.maps, "%s was read", path);
    CHECK(strstr(st.message, path) && strstr(st.message, word) && !strchr(st.message, '\n'),
          "not one line about \"%s\": %s", word, st.message);
}

TEST(maps_exr_damaged)
{
    const char *folder = test_folder();
    char path[512];
    ts_status st = {0};
    io_material m = random_material(20, 2);
    snprintf(path, sizeof path, "%s/maps.exr", folder);
    CHECK(io_write_maps_exr(path, &m, false, false, 0, &st) == TS_OK, "%s", st.message);
    bytes whole = bytes_load(path);
    for (size_t size = 1; size < whole.size; size += 1 + whole.size / 97) {
        bytes part = {0};
        put(&part, whole.data, size);
        exr_refused(bytes_save(&part, folder, "part.exr"), ": ");
    }
    /* Any byte of the header changed: read or refused, never a crash; size bombs among them. */
    unsigned state = 3;
    for (int round = 0; round < 300; round++) {
        bytes bad = {0};
        put(&bad, whole.data, whole.size);
        bad.data[(unsigned)(uniform(&state) * 600)] = (uint8_t)(uniform(&state) * 256);
        const char *bad_path = bytes_save(&bad, folder, "bad.exr");
        io_material back;
        ts_status line = {0};
        if (io_read_maps_exr(bad_path, &back, &line) != TS_OK)
            CHECK(line.message[0] && !strchr(line.message, '\n'), "no line in round %d", round);
        io_material_free(&back);
    }
    bytes_free(&whole);
    const float pixels[12] = {0};
    bytes b = exr_file(2, 2, pixels, NULL);
    exr_refused(bytes_save(&b, folder, "rgb.exr"), "diffuse.B is missing");
    b = exr_file(4, 1, pixels, NULL);
    exr_refused(bytes_save(&b, folder, "wide.exr"), "not square");
    b = exr_file(1000000, 1000000, NULL, NULL);
    exr_refused(bytes_save(&b, folder, "bomb.exr"), ": ");
    put(&b, "no EXR file at all", 18);
    exr_refused(bytes_save(&b, folder, "words.exr"), ": ");
    exr_refused(folder, "folder");
}

TEST(strip_round_trip)
{
    io_material m = random_material(24, 3), back;
    io_image input, seen;
    char path[512];
    ts_status st = {0};
    CHECK(io_image_create(&input, 24, 24, 3, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < 24 * 24 * 3; i++) input.data[i] = (float)(i % 300) / 300;
    snprintf(path, sizeof path, "%s/my.strip.png", test_folder());
    CHECK(io_write_strip(path, &m, &input, &st) == TS_OK, "%s", st.message);
    CHECK(io_read_strip(path, 0, &back, &seen, &st) == TS_OK, "%s", st.message);
    CHECK(back.size == 24 && seen.width == 24 && seen.channels == 3, "size %d", back.size);
    CHECK(!strcmp(back.name, "my.strip"), "named %s", back.name);
    for (int i = 0; i < 24 * 24 * MAP_CHANNELS; i++)
        CHECK(fabsf(m.maps[i] - back.maps[i]) < 4e-5f, "value %d: %g became %g", i, (double)m.maps[i],
              (double)back.maps[i]);
    for (int i = 0; i < 24 * 24 * 3; i++)
        CHECK(fabsf(input.data[i] - seen.data[i]) < 1e-5f, "input %d: %g", i, (double)seen.data[i]);
    io_material_free(&back);
    CHECK(io_read_strip(path, 7, &back, NULL, &st) == TS_OK && back.size == 7, "%s", st.message);
    io_image small = {7, 7, 3, input.data};
    CHECK(io_write_strip(path, &m, &small, &st) == TS_INVALID && strstr(st.message, path),
          "an input of another size: %s", st.message);
    CHECK(io_write_png(path, &input, 8, false, &st) == TS_OK && io_read_strip(path, 0, &back, NULL, &st) == TS_FORMAT &&
              strstr(st.message, "24 x 24"),
          "a square image is no strip: %s", st.message);
    io_image_free(&input);
}

/* Each panel is resampled on its own: nothing of its neighbour comes over the edge. */
TEST(strip_panels_do_not_bleed)
{
    io_material m, back;
    io_image input;
    char path[512];
    ts_status st = {0};
    CHECK(io_material_create(&m, 30, &st) == TS_OK && io_image_create(&input, 30, 30, 3, &st) == TS_OK, "%s",
          st.message);
    const io_texel t = {{1, 1, 1}, {0, 0, 1}, 0, {1, 1, 1}};
    for (int i = 0; i < 900; i++) io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(io_write_strip(path, &m, &input, &st) == TS_OK && io_read_strip(path, 4, &back, &input, &st) == TS_OK, "%s",
          st.message);
    for (int i = 0; i < 16; i++) {
        io_texel got = io_texel_get(back.maps + i * MAP_CHANNELS);
        CHECK(got.roughness < 1e-6f && got.diffuse[0] > 0.99999f && got.specular[2] > 0.99999f &&
                  input.data[3 * i] == 0,
              "pixel %d is mixed", i);
    }
}

static bool exists(const char *folder, const char *name)
{
    char path[600];
    struct stat info;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return !stat(path, &info);
}

/* What lgd writes, lgd reads: as a map folder, with the convention it was written in. */
TEST(written_maps_are_a_map_folder)
{
    io_material m = random_material(16, 9), back;
    ts_status st = {0};
    for (int directx = 0; directx < 2; directx++) {
        CHECK(io_write_maps(test_folder(), &m, IO_MAPS_ALL, directx, &st) == TS_OK, "%s", st.message);
        CHECK(exists(test_folder(), "diffuse.png") && exists(test_folder(), "maps.exr"), "files are missing");
        CHECK(io_read_map_folder(test_folder(), NULL, 0, &back, &st) == TS_OK, "%s", st.message);
        CHECK(back.size == 16, "size %d", back.size);
        for (int i = 0; i < 256; i++) {
            io_texel a = io_texel_get(m.maps + i * MAP_CHANNELS), b = io_texel_get(back.maps + i * MAP_CHANNELS);
            for (int c = 0; c < 3; c++) {
                CHECK(fabsf(a.normal[c] - b.normal[c]) < 1e-4f, "normal %g became %g (%d)", (double)a.normal[c],
                      (double)b.normal[c], directx);
                CHECK(fabsf(a.diffuse[c] - b.diffuse[c]) < 0.006f && fabsf(a.specular[c] - b.specular[c]) < 0.006f,
                      "colour at %d", i);
            }
            CHECK(fabsf(a.roughness - b.roughness) < 1e-4f, "roughness at %d", i);
        }
        io_material_free(&back);
    }
    io_material_free(&m);
}

TEST(which_maps_are_written)
{
    io_material m = random_material(4, 9);
    ts_status st = {0};
    CHECK(io_write_maps(test_folder(), &m, IO_MAPS_ROUGHNESS | IO_MAPS_SPECULAR, false, &st) == TS_OK, "%s",
          st.message);
    CHECK(exists(test_folder(), "roughness.png") && exists(test_folder(), "specular.png"), "files are missing");
    CHECK(!exists(test_folder(), "diffuse.png") && !exists(test_folder(), "normal.png") &&
              !exists(test_folder(), "maps.exr"),
          "files too many");
    CHECK(io_write_maps("/dev/null", &m, IO_MAPS_ALL, false, &st) == TS_IO &&
              strstr(st.message, "/dev/null/diffuse.png"),
          "%s", st.message);
    for (unsigned which = 1; which <= IO_MAPS_EXR; which *= 2) {
        st = (ts_status){0};
        CHECK(io_write_maps("/missing/folder", &m, which, false, &st) == TS_IO &&
                  strstr(st.message, "/missing/folder") && !strchr(st.message, '\n'),
              "map %u: %s", which, st.message);
    }
    if (access("/dev/full", W_OK) == 0)
        CHECK(io_write_maps_exr("/dev/full", &m, false, false, 0, &st) == TS_IO && strstr(st.message, "/dev/full"),
              "a full device");
}

TEST(material_sizes)
{
    ts_status st = {0};
    io_material m;
    static const int bad[] = {0, -1, 1 << 30};
    for (int i = 0; i < 3; i++) CHECK(io_material_create(&m, bad[i], &st) == TS_INVALID && !m.maps, "size %d", bad[i]);
}
