/* Multi-view captures: written, read, and refused where a file says something else. */
#include "data/capture.h"
#include "data/file.h"
#include "data/materials/procedural.h"
#include "render/render.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SIZE = 12, IMAGES = 3 };

static void make(io_capture *c)
{
    ts_status st = {0};
    CHECK(io_capture_create(c, IMAGES, SIZE, &st) == TS_OK, "%s", st.message);
    ts_rng r = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (int i = 0; i < IMAGES * SIZE * SIZE * 3; i++) c->image[i] = ts_rng_uniform(&r);
    for (int i = 0; i < IMAGES; i++)
        for (int k = 0; k < 3; k++) {
            c->camera[i][k] = k == 2 ? 1 + ts_rng_uniform(&r) : ts_rng_range(&r, -1, 1);
            c->light[i][k] = k == 2 ? 1 + ts_rng_uniform(&r) : ts_rng_range(&r, -1, 1);
        }
    c->side = 17.3f;
    c->power[0] = 5, c->power[1] = 4.5f, c->power[2] = 3.25f;
}

static void text(const char *name, const char *content)
{
    char path[256];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/%s", test_folder(), name);
    CHECK(io_write_bytes(path, content, strlen(content), &st) == TS_OK, "%s", st.message);
}

TEST(capture_comes_back)
{
    io_capture c, back;
    ts_status st = {0};
    make(&c);
    CHECK(!io_is_capture(test_folder()), "an empty folder is a capture");
    CHECK(io_write_capture(test_folder(), &c, &st) == TS_OK && io_is_capture(test_folder()), "%s", st.message);
    CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
    CHECK(back.images == IMAGES && back.size == SIZE && back.side == c.side, "%d images of %d, side %g", back.images,
          back.size, (double)back.side);
    for (int i = 0; i < IMAGES; i++)
        for (int k = 0; k < 3; k++) {
            CHECK(fabsf(back.camera[i][k] - c.camera[i][k]) <= 3e-7f * fabsf(c.camera[i][k]), "camera %d: %g, not %g",
                  i, (double)back.camera[i][k], (double)c.camera[i][k]);
            CHECK(fabsf(back.light[i][k] - c.light[i][k]) <= 3e-7f * fabsf(c.light[i][k]), "light %d", i);
            CHECK(fabsf(back.power[k] - c.power[k]) <= 3e-7f * c.power[k], "power");
        }
    for (int i = 0; i < IMAGES * SIZE * SIZE * 3; i++) {
        const double stored = round(pow((double)c.image[i], 1 / 2.2) * 255) / 255;
        CHECK(fabs((double)back.image[i] - pow(stored, 2.2)) < 1e-6, "value %d: %g, not %g", i, (double)back.image[i],
              pow(stored, 2.2));
    }
    io_capture_free(&back);
    CHECK(io_read_capture(test_folder(), 6, 3, &back, &st) == TS_UNSUPPORTED && !back.image,
          "more pixels than allowed");
    st = (ts_status){0};
    char folder[256];
    snprintf(folder, sizeof folder, "%s/wood_3.5cm", test_folder());
    CHECK(!mkdir(folder, 0700) && !io_write_capture(folder, &c, &st) &&
              !io_read_capture(folder, 6, 1 << 20, &back, &st),
          "%s", st.message);
    CHECK(!strcmp(back.name, "wood_3.5cm"), "named %s", back.name);
    io_capture_free(&back);
    CHECK(io_read_capture(test_folder(), 6, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK && back.size == 6, "%s",
          st.message);
    double a = 0, b = 0;
    for (int i = 0; i < SIZE * SIZE * 3; i++) a += (double)c.image[i] / (SIZE * SIZE);
    for (int i = 0; i < 6 * 6 * 3; i++) b += (double)back.image[i] / (6 * 6);
    CHECK(fabs(a - b) < 0.05, "resampling changes the mean from %g to %g", a, b);
    io_capture_free(&back);
    io_capture_free(&c);
}

TEST(capture_text_as_people_write_it)
{
    io_capture c, back;
    ts_status st = {0};
    make(&c);
    CHECK(io_write_capture(test_folder(), &c, &st) == TS_OK, "%s", st.message);
    text("camera_pos.txt",
         "\xef\xbb\xbf"
         "0,0,10\r\n\r\n 1, -2 ,\t3e1\r\n-1 2 20");
    text("image_size.txt", "10\n\n");
    CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
    const float expected[3][3] = {{0, 0, 1}, {0.1f, -0.2f, 3}, {-0.1f, 0.2f, 2}};
    for (int i = 0; i < 9; i++)
        CHECK(fabsf(back.camera[i / 3][i % 3] - expected[i / 3][i % 3]) < 1e-6f, "camera %d: %g", i,
              (double)back.camera[i / 3][i % 3]);
    io_capture_free(&back);
    io_capture_free(&c);
}

TEST(capture_that_is_wrong_is_refused)
{
    static const struct {
        const char *file, *content, *says;
    } wrong[] = {
        {"camera_pos.txt", "0,0,10\n0,0,10\n", "camera_pos.txt"}, /* a picture too many */
        {"camera_pos.txt", "0,0,10\n0,0,10\n0,0,10\n0,0,10\n", "light_pos.txt"},
        {"camera_pos.txt", "", "camera_pos.txt"},
        {"camera_pos.txt", "0,0,10\n0,0\n0,0,10\n", "camera_pos.txt:2"},
        {"camera_pos.txt", "0,0,10\n0,0,10,4\n0,0,10\n", "camera_pos.txt:2"},
        {"camera_pos.txt", "0,0,10\n0,0,ten\n0,0,10\n", "camera_pos.txt:2"},
        {"camera_pos.txt", "0,0,10\n0,0,10\n0,0,-10\n", "camera_pos.txt: number 3"},
        {"light_pos.txt", "0,0,10\n0,0,nan\n0,0,10\n", "light_pos.txt:2"},
        {"light_pos.txt", "0,0,10\n0,0,10\n", "light_pos.txt"},
        {"image_size.txt", "0", "image_size.txt"},
        {"image_size.txt", "10,10", "image_size.txt"},
        {"image_size.txt", "", "image_size.txt"},
        {"light_power.txt", "100", "light_power.txt"},
        {"light_power.txt", "100,0,100", "light_power.txt"},
        {"01.png", "no picture", "01.png"},
    };
    io_capture c, back;
    make(&c);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        ts_status st = {0};
        CHECK(io_write_capture(test_folder(), &c, &st) == TS_OK, "%s", st.message);
        text(wrong[i].file, wrong[i].content);
        CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &back, &st) != TS_OK && !back.image,
              "case %zu was read", i);
        CHECK(strstr(st.message, wrong[i].says), "case %zu: no '%s' in: %s", i, wrong[i].says, st.message);
    }
    static const char *const files[] = {"00.png",        "02.png",         "camera_pos.txt",
                                        "light_pos.txt", "image_size.txt", "light_power.txt"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        ts_status st = {0};
        char path[256];
        CHECK(io_write_capture(test_folder(), &c, &st) == TS_OK, "%s", st.message);
        snprintf(path, sizeof path, "%s/%s", test_folder(), files[i]);
        CHECK(unlink(path) == 0, "unlink");
        CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &back, &st) != TS_OK &&
                  strstr(st.message, files[i]),
              "without %s: %s", files[i], st.message);
    }
    ts_status st = {0};
    io_image wide;
    char path[256];
    CHECK(io_write_capture(test_folder(), &c, &st) == TS_OK && io_image_create(&wide, 8, 6, 3, &st) == TS_OK, "%s",
          st.message);
    snprintf(path, sizeof path, "%s/01.png", test_folder());
    CHECK(io_write_png(path, &wide, 8, false, &st) == TS_OK, "%s", st.message);
    CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &back, &st) != TS_OK && strstr(st.message, "square"),
          "a wide picture: %s", st.message);
    io_image_free(&wide);
    io_capture_free(&c);
}
