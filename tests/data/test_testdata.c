/* Every photograph and strip of TESTDATA. */
#include "data/material.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <string.h>

/* Calls f with each file of the folder and returns how many there were. */
static int each_file(const char *folder, void (*f)(const char *path))
{
    char path[2048];
    int count = 0;
    DIR *d = opendir(folder);
    CHECK(d, "cannot open %s", folder);
    for (struct dirent *e; (e = readdir(d));) {
        if (e->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        f(path);
        count++;
    }
    closedir(d);
    return count;
}

static void one_photo(const char *path)
{
    ts_status st = {0};
    io_image image, square;
    CHECK(io_read_photo(path, IO_MAX_PIXELS_DEFAULT, &image, &st) == TS_OK, "%s", st.message);
    CHECK(image.width >= 256 && image.height >= 256 && image.channels == 3, "%s: %d x %d", path, image.width,
          image.height);
    CHECK(io_centre_square(&image, 128, 0, &square, &st) == TS_OK && square.width == 128 && square.height == 128,
          "%s: %s", path, st.message);
    double sum = 0, centre = 0;
    for (int i = 0; i < 128 * 128 * 3; i++) {
        float v = square.data[i];
        CHECK(v >= 0 && v <= 1.00001f, "%s: value %g", path, (double)v);
        sum += (double)v;
        int x = i / 3 % 128, y = i / 3 / 128;
        if (x >= 32 && x < 96 && y >= 32 && y < 96) centre += (double)v;
    }
    /* A flash photograph: neither black nor white on average, and its middle no darker than the rest by much. */
    double mean = sum / (128 * 128 * 3), middle = centre / (64 * 64 * 3);
    CHECK(mean > 0.03 && mean < 0.6, "%s: mean %g", path, mean);
    CHECK(middle > 0.8 * mean, "%s: middle %g, mean %g", path, middle, mean);
    io_image_free(&image);
    io_image_free(&square);
}

TEST(every_photograph)
{
    char folder[1024];
    snprintf(folder, sizeof folder, "%s/photos", test_data());
    int count = each_file(folder, one_photo);
    CHECK(count >= 26, "%d photographs", count);
}

static void one_strip(const char *path)
{
    ts_status st = {0};
    io_material m;
    io_image input;
    CHECK(io_read_strip(path, 0, &m, &input, &st) == TS_OK, "%s", st.message);
    CHECK(m.size == 288 && input.width == 288 && input.height == 288 && m.name[0], "%s: %d", path, m.size);
    double mean[MAP_CHANNELS] = {0}, z = 0, lit = 0;
    int pixels = m.size * m.size;
    for (int i = 0; i < pixels; i++) {
        const float *maps = m.maps + i * MAP_CHANNELS;
        for (int c = 0; c < MAP_CHANNELS; c++) mean[c] += (double)maps[c] / pixels;
        z += (double)io_texel_get(maps).normal[2] / pixels;
        lit += (double)(input.data[3 * i] + input.data[3 * i + 1] + input.data[3 * i + 2]) / (3 * pixels);
    }
    CHECK(fabs(mean[MAP_NORMAL]) < 0.15 && fabs(mean[MAP_NORMAL + 1]) < 0.15 && z > 0.8, "%s: mean normal %g %g %g",
          path, mean[3], mean[4], z);
    double rough = mean[MAP_ROUGHNESS] / 2 + 0.5, f0 = mean[MAP_SPECULAR] / 2 + 0.5,
           albedo = mean[MAP_DIFFUSE] / 2 + 0.5;
    CHECK(rough > 0.1 && rough < 0.9 && f0 > 0.03 && f0 < 0.5 && albedo > 0.001 && albedo < 0.6,
          "%s: roughness %g, F0 %g, albedo %g", path, rough, f0, albedo);
    CHECK(lit > 0.005 && lit < 0.6, "%s: input %g", path, lit);
    io_material_free(&m);
    io_image_free(&input);
}

TEST(every_strip)
{
    char folder[1024];
    snprintf(folder, sizeof folder, "%s/strips", test_data());
    int count = each_file(folder, one_strip);
    CHECK(count >= 16, "%d strips", count);
}
