/* Map folders of flat pictures. */
#ifndef TESTS_MAP_FOLDERS_H
#define TESTS_MAP_FOLDERS_H
#include "data/material.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>
#include <sys/stat.h>

/* A fresh folder of the test's folder. */
static inline const char *fresh(const char *name)
{
    static char path[4][512];
    static int next;
    char *p = path[next++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", test_folder(), name);
    CHECK(!mkdir(p, 0700), "mkdir %s", p);
    return p;
}

/* A flat 8-bit PNG. */
static inline void flat(const char *folder, const char *name, int width, int height, int r, int g, int b)
{
    bytes f = {0};
    uint8_t pixels[32 * 32 * 3];
    CHECK(width * height <= 32 * 32, "too large");
    for (int i = 0; i < width * height; i++)
        pixels[3 * i] = (uint8_t)r, pixels[3 * i + 1] = (uint8_t)g, pixels[3 * i + 2] = (uint8_t)b;
    png_begin(&f, (uint32_t)width, (uint32_t)height, 8, 2), png_pixels(&f, pixels, (size_t)width * 3, height),
        png_end(&f);
    bytes_save(&f, folder, name);
}

static inline void words(const char *folder, const char *name, const char *text)
{
    bytes f = {0};
    put(&f, text, strlen(text));
    bytes_save(&f, folder, name);
}

/* Colour 128 = 0.2159 linear, normal with y = +0.6 as OpenGL writes it, roughness 51 = 0.2. */
static inline const char *usual(const char *name)
{
    const char *folder = fresh(name);
    flat(folder, "basecolor.png", 4, 4, 128, 128, 128);
    flat(folder, "normal.png", 4, 4, 128, 204, 230);
    flat(folder, "roughness.png", 4, 4, 51, 51, 51);
    return folder;
}

static inline io_texel first(const char *folder, io_normal convention, int size)
{
    ts_status st = {0};
    io_material m;
    CHECK(io_read_map_folder(folder, &(io_map_convention){.normal = convention}, size, &m, &st) == TS_OK, "%s",
          st.message);
    io_texel t = io_texel_get(m.maps);
    io_material_free(&m);
    return t;
}

/* Refused in one line that names the folder and says word. */
static inline void refused(const char *folder, io_normal convention, const char *word)
{
    ts_status st = {0};
    io_material m;
    CHECK(io_read_map_folder(folder, &(io_map_convention){.normal = convention}, 0, &m, &st) != TS_OK && !m.maps,
          "%s was read", folder);
    CHECK(strstr(st.message, folder) && strstr(st.message, word) && !strchr(st.message, '\n'), "no \"%s\" in: %s", word,
          st.message);
}

static inline bool near(float a, float b, float tolerance) { return fabsf(a - b) <= tolerance; }
#endif
