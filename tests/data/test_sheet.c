/* Photographs of a printed sheet, made and solved again. */
#include "cli/data/sheet_captures.h"
#include "data/capture.h"
#include "data/materials/procedural.h"
#include "data/rectify/sheet_check.h"
#include "infer/angle.h"
#include "infer/sheet.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 64, WIDTH = 1000 };

static void need_tags(void)
{
    io_tag_image black[IO_SHEET_TAGS];
    ts_status st = {0};
    if (io_tag_images(black, &st) == TS_UNSUPPORTED) test_skip("%s", st.message);
}

static void make_set(const char *folder, int width, uint64_t index)
{
    ts_status st = {0};
    io_material m = {0};
    /* matt and coarse: the window shows no burnt-out highlight and no line as fine as a pixel */
    const io_procedural p = {.seed = 5, .families = io_family_mask("pebbles")};
    CHECK(!io_material_create(&m, SIZE, &st), "%s", st.message);
    io_procedural_make(&p, index, &m);
    CHECK(!cl_write_sheet_captures(folder, &m, 5, index, width, 92, &st), "%s", st.message);
    io_material_free(&m);
}

static void name_photos(const char *folder, char path[CL_SHEET_SHOTS][512], char *paths[CL_SHEET_SHOTS])
{
    for (int i = 0; i < CL_SHEET_SHOTS; i++) {
        snprintf(path[i], 512, "%s/photo_%d.jpg", folder, i + 1);
        paths[i] = path[i];
    }
}

/* The pose, factor and distortion come back from corners without noise. */
TEST(sheet_solve_is_exact)
{
    cl_sheet_shot shot[CL_SHEET_SHOTS];
    io_sight sight[CL_SHEET_SHOTS] = {0};
    ts_status st = {0};
    cl_sheet_shots(3, 0, 4000, shot);
    for (int i = 0; i < CL_SHEET_SHOTS; i++) {
        io_sight *s = &sight[i];
        s->camera = (io_pinhole){.width = 4000, .height = 3000, .focal = 0.9 * shot[i].camera.focal};
        s->tags.count = IO_SHEET_TAGS;
        for (int t = 0; t < IO_SHEET_TAGS; t++) {
            double point[4][2];
            s->tags.id[t] = t;
            io_tag_corners(t, point);
            for (int k = 0; k < 4; k++) io_pinhole_see(&shot[i].camera, point[k], s->tags.corner[t][k]);
        }
        s->tags.corner[3][1][0] += 40; /* a tag that something hides in part */
    }
    int bad;
    CHECK(!io_solve(sight, CL_SHEET_SHOTS, false, &bad, &st) && bad == -1, "%s", st.message);
    for (int i = 0; i < CL_SHEET_SHOTS; i++) {
        const io_pinhole *c = &sight[i].camera, *t = &shot[i].camera;
        const double away = hypot(hypot(c->at[0] - t->at[0], c->at[1] - t->at[1]), c->at[2] - t->at[2]);
        CHECK(sight[i].tags.count == IO_SHEET_TAGS - 1, "%d tags are left", sight[i].tags.count);
        CHECK(away * IO_SHEET_WINDOW < 0.02, "camera %d is off by %g mm", i, away * IO_SHEET_WINDOW);
        CHECK(fabs(c->focal / t->focal - 1) < 1e-4 && fabs(c->radial - t->radial) < 1e-3,
              "focal %g of %g, radial %g of %g", c->focal, t->focal, c->radial, t->radial);
    }
    for (int t = 0; t < sight[2].tags.count; t++) /* as in a mirror: seen from below */
        for (int k = 0; k < 4; k++) sight[2].tags.corner[t][k][0] = 4000 - sight[2].tags.corner[t][k][0];
    CHECK(io_solve(sight, CL_SHEET_SHOTS, false, &bad, &st) == TS_INVALID && bad == 2, "sight %d: '%s'", bad,
          st.message);
}

/* The windows come out as what is under them, as bright as their light makes them. */
TEST(sheet_windows_of_a_set)
{
    need_tags();
    char path[CL_SHEET_SHOTS][512], exact_path[512], *paths[CL_SHEET_SHOTS];
    ts_status st = {0};
    io_sheet_set set;
    io_capture c, exact;
    make_set(test_folder(), WIDTH, 1);
    name_photos(test_folder(), path, paths);
    snprintf(exact_path, sizeof exact_path, "%s/exact", test_folder());
    CHECK(!io_read_capture(exact_path, SIZE, IO_MAX_PIXELS_DEFAULT, &exact, &st), "%s", st.message);
    CHECK(!io_sheet_set_read(paths, CL_SHEET_SHOTS, 0, 1 << 26, 1, NULL, &set, &st), "%s", st.message);
    CHECK(!lgd_sheet_capture(&set, 3, SIZE, 1 << 26, 1, &c, &st), "%s", st.message);
    CHECK(c.images == 3, "%d windows", c.images);
    int order[IO_SOLVE_MOST];
    lgd_sheet_order(&set, order);
    CHECK(order[0] == 0, "photograph %d is the first", order[0] + 1);
    for (int k = 0; k < 3; k++) {
        const size_t values = SIZE * SIZE * 3;
        const float *a = c.image + (size_t)k * values, *b = exact.image + (size_t)order[k] * values;
        const float ratio = c.power[0] / exact.power[0];
        double worst = 0;
        for (int block = 0; block < 64;
             block++) { /* means of 8 x 8 pixels: the picture of a pixel is a little blurred */
            double sum = 0, bright = 0;
            for (int i = 0; i < 64 * 3; i++) {
                const int y = block / 8 * 8 + i / 24, x = block % 8 * 8 + i / 3 % 8;
                const size_t at = ((size_t)y * SIZE + (size_t)x) * 3 + (size_t)(i % 3);
                sum += (double)(a[at] - fminf(b[at] * ratio, 1));
                bright += (double)a[at];
            }
            worst = farther(worst, fabs(sum) / fmax(bright, 1));
        }
        CHECK(worst < 0.05, "window %d: a part is %g brighter or darker", k, worst);
        for (int i = 0; i < 3; i++)
            CHECK(fabsf(c.light[k][i] - exact.light[order[k]][i]) < 0.03f, "light %d: %g, not %g", k,
                  (double)c.light[k][i], (double)exact.light[order[k]][i]);
    }
    io_capture_free(&c);
    io_capture_free(&exact);
    io_sheet_set_free(&set);
}

/* A copy of a photograph: so many side by side, grey from column x and row y on. */
static void copy_photo(const char *from, const char *to, int times, double x0, double y0)
{
    io_image in, out;
    ts_status st = {0};
    CHECK(!io_read_photo(from, 1 << 26, &in, &st), "%s", st.message);
    CHECK(!io_image_create(&out, in.width * times, in.height, 3, &st), "%s", st.message);
    for (int y = 0; y < out.height; y++)
        for (int x = 0; x < out.width; x++)
            for (int k = 0; k < 3; k++)
                out.data[((size_t)y * (size_t)out.width + (size_t)x) * 3 + (size_t)k] = x >= x0 || y >= y0
                    ? 0.3f
                    : in.data[((size_t)y * (size_t)in.width + (size_t)(x % in.width)) * 3 + (size_t)k];
    CHECK(!io_write_png(to, &out, 8, true, &st), "%s", st.message);
    io_image_free(&in);
    io_image_free(&out);
}

/* The place between two tags in a photograph. */
static void between_tags(const io_pinhole *c, int a, int b, double pixel[2])
{
    double p[2], q[2];
    io_tag_centre(a, p);
    io_tag_centre(b, q);
    io_pinhole_see(c, (const double[2]){(p[0] + q[0]) / 2, (p[1] + q[1]) / 2}, pixel);
}

TEST(sheet_photographs_that_cannot_be_used)
{
    need_tags();
    char path[CL_SHEET_SHOTS][512], *paths[CL_SHEET_SHOTS];
    ts_status st = {0};
    io_sheet_set set;
    make_set(test_folder(), WIDTH, 2);
    name_photos(test_folder(), path, paths);
    cl_sheet_shot shot[CL_SHEET_SHOTS];
    double right[2], low[2];
    cl_sheet_shots(5, 2, WIDTH, shot);
    between_tags(&shot[0].camera, 2, 3, right);
    between_tags(&shot[0].camera, 18, 19, low); /* tags 0, 1, 2 and 19 are left */
    static const char *const file[] = {"none.png", "two.png", "hidden.png", "absent.png"};
    static const char *const says[] = {"no tag", "one sheet alone", "whole frame", "absent.png"};
    for (int i = 0; i < 3; i++) {
        char to[512];
        snprintf(to, sizeof to, "%s/%s", test_folder(), file[i]);
        copy_photo(path[0], to, i == 1 ? 2 : 1, i == 2 ? right[0] : 1e9, i == 0 ? 0 : i == 2 ? low[1] : 1e9);
    }
    for (int i = 0; i < 4; i++) snprintf(path[i + 1], 512, "%s/%s", test_folder(), file[i]);
    CHECK(!io_sheet_set_read(paths, 5, 0, 1 << 26, 1, NULL, &set, &st), "%s", st.message);
    CHECK(set.good == 1 && !set.photo[0].st.code, "%d are good: %s", set.good, set.photo[0].st.message);
    for (int i = 0; i < 4; i++)
        CHECK(strstr(set.photo[i + 1].st.message, says[i]) && strstr(set.photo[i + 1].st.message, file[i]), "%s: %s",
              file[i], set.photo[i + 1].st.message);
    io_sheet_set_free(&set);
}

/* A copy that is blurred over 2 r + 1 pixels a side, gain times brighter, and white inside of the window. */
static void spoil(const char *from, const char *to, const io_pinhole *camera, int r, float gain, bool white)
{
    io_image in, out;
    ts_status st = {0};
    double left[2], right[2];
    io_pinhole_see(camera, (const double[2]){-0.4, 0.4}, left);
    io_pinhole_see(camera, (const double[2]){0.4, -0.4}, right);
    CHECK(!io_read_photo(from, 1 << 26, &in, &st), "%s", st.message);
    CHECK(!io_image_create(&out, in.width, in.height, 3, &st), "%s", st.message);
    for (int y = r; y < in.height - r; y++)
        for (int x = r; x < in.width - r; x++)
            for (int k = 0; k < 3; k++) {
                const bool inside = x > left[0] && x < right[0] && y > left[1] && y < right[1];
                float sum = 0;
                for (int i = -r; i <= r; i++)
                    for (int j = -r; j <= r; j++)
                        sum += in.data[((size_t)(y + j) * (size_t)in.width + (size_t)(x + i)) * 3 + (size_t)k];
                out.data[((size_t)y * (size_t)in.width + (size_t)x) * 3 + (size_t)k] = white && inside
                    ? 1
                    : fminf(gain * sum / (float)((2 * r + 1) * (2 * r + 1)), 1);
            }
    CHECK(!io_write_png(to, &out, 8, true, &st), "%s", st.message);
    io_image_free(&in);
    io_image_free(&out);
}

static bool at_once(void) { return true; }

TEST(sheet_reading_stops)
{
    char *paths[] = {(char *)"absent.png"};
    io_sheet_set set;
    ts_status st = {0};
    CHECK(io_sheet_set_read(paths, 1, 0, 1 << 26, 1, at_once, &set, &st) == TS_INTERRUPTED && !set.photo, "%s",
          st.message);
}

TEST(sheet_faults_are_named)
{
    need_tags();
    char path[CL_SHEET_SHOTS][512], *paths[CL_SHEET_SHOTS];
    ts_status st = {0};
    io_sheet_set set;
    cl_sheet_shot shot[CL_SHEET_SHOTS];
    make_set(test_folder(), WIDTH, 2);
    name_photos(test_folder(), path, paths);
    cl_sheet_shots(5, 2, WIDTH, shot);
    char from[512];
    snprintf(from, sizeof from, "%s", path[0]);
    static const char *const file[] = {"blurred.png", "burnt.png", "white.png", "dark.png"};
    for (int i = 0; i < 4; i++) {
        snprintf(path[i + 1], 512, "%s/%s", test_folder(), file[i]);
        spoil(from, path[i + 1], &shot[0].camera, i == 0 ? 2 : 0, i == 1 ? 6 : i == 3 ? 0.002f : 1, i == 2);
    }
    CHECK(!io_sheet_set_read(paths, 4, 54, 1 << 26, 1, NULL, &set, &st), "%s", st.message);
    CHECK(!set.photo[0].st.code && io_sheet_faults(&set.photo[0]) == 0, "the good one: %u",
          io_sheet_faults(&set.photo[0]));
    CHECK(!set.photo[1].st.code && io_sheet_faults(&set.photo[1]) & IO_FAULT_BLURRED, "blurred: %s edges of %g",
          set.photo[1].st.message, set.photo[1].edge);
    CHECK(strstr(set.photo[2].st.message, "burnt out"), "burnt: %s", set.photo[2].st.message);
    CHECK(!set.photo[3].st.code && io_sheet_faults(&set.photo[3]) == IO_FAULT_BURNT, "a white window: %s %u",
          set.photo[3].st.message, io_sheet_faults(&set.photo[3]));
    CHECK(io_sheet_apart(&set) < IO_SHEET_APART, "one place is %g degrees from itself", io_sheet_apart(&set));
    io_sheet_set_free(&set);
    CHECK(!io_sheet_set_read(paths + 4, 1, 54, 1 << 26, 1, NULL, &set, &st), "%s", st.message);
    CHECK(set.good == 0 && *set.photo[0].st.message, "a dark one can be used");
    io_sheet_set_free(&set);
}
