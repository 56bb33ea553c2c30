/* Photographs taken at an angle. */
#include "data/capture_ini.h"
#include "data/file.h"
#include "data/rectify/homography.h"
#include "data/rectify/least_squares.h"
#include "data/rectify/warp.h"
#include "infer/angle.h"
#include "render/scene.h"
#include "tensor/rng.h"
#include "tests/support/angled.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

TEST(angle_homography_and_pose)
{
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    ts_status st = {0};
    for (int i = 0; i < 200; i++) {
        const io_pinhole true_camera = angled_camera(
            4000, 3000, 3005, 1.5 + (double)ts_rng_uniform(&rng), 60 * (double)ts_rng_uniform(&rng),
            6.28 * (double)ts_rng_uniform(&rng), 6.28 * (double)ts_rng_uniform(&rng));
        double pixel[4][2], to[2], rms;
        for (int k = 0; k < 4; k++) CHECK(io_pinhole_see(&true_camera, angled_square[k], pixel[k]), "behind");
        io_homography h;
        CHECK(io_homography_fit(4, angled_square, (const double(*)[2])pixel, &h), "no homography");
        const double inside[2] = {0.21, -0.37};
        double want[2];
        io_pinhole_see(&true_camera, inside, want);
        io_homography_apply(&h, inside, to);
        CHECK(hypot(to[0] - want[0], to[1] - want[1]) < 1e-6, "the homography misses by %g pixels",
              hypot(to[0] - want[0], to[1] - want[1]));
        io_pinhole c = {4000, 3000, 3005, 0, {{0}}, {0}};
        CHECK(!io_pinhole_pose(4, angled_square, (const double(*)[2])pixel, &c, &rms, &st), "%s", st.message);
        io_pinhole other = {4000, 3000, 2000, 0, {{0}}, {0}}; /* of another lens: no perfect fit, but a rotation */
        CHECK(!io_pinhole_pose(4, angled_square, (const double(*)[2])pixel, &other, &rms, &st), "%s", st.message);
        for (int k = 0; k < 9; k++) {
            double product = 0;
            for (int n = 0; n < 3; n++) product += other.rotation[k / 3][n] * other.rotation[k % 3][n];
            CHECK(fabs(product - (k / 3 == k % 3)) < 1e-9, "rows %d and %d of the rotation: %g", k / 3, k % 3, product);
        }
        for (int k = 0; k < 3; k++)
            CHECK(fabs(c.at[k] - true_camera.at[k]) < 1e-6, "camera %d: %g, not %g", k, c.at[k], true_camera.at[k]);
    }
}

TEST(angle_least_squares)
{
    double singular[4] = {1, 1, 1, 1}, b[2] = {1, 1};
    CHECK(!io_solve_symmetric(2, singular, b), "a singular system has a solution");
    double a[4] = {4, 1, 1, 3}, x[2] = {1, 2};
    CHECK(io_solve_symmetric(2, a, x) && fabs(x[0] - 1.0 / 11) < 1e-15 && fabs(x[1] - 7.0 / 11) < 1e-15, "%g %g", x[0],
          x[1]);
}

/* A square of the pattern, seen at an angle, comes back as it is, and the camera with it. */
TEST(angle_rectifies)
{
    char path[512], words[256];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/angled.png", test_folder());
    for (int shares = 0; shares < 2; shares++) {
        const io_pinhole camera = angled_camera(400, 300, 320, 2, 35, 0.7 + shares, 0.3);
        double p[4][2];
        angled_write(path, &camera);
        for (int k = 0; k < 4; k++) {
            io_pinhole_see(&camera, angled_square[k], p[k]);
            if (shares) p[k][0] /= 400, p[k][1] /= 300;
        }
        snprintf(words, sizeof words, "%.6f,%.6f %.6f,%.6f %.6f,%.6f  %.6f,%.6f ", p[0][0], p[0][1], p[1][0], p[1][1],
                 p[2][0], p[2][1], p[3][0], p[3][1]);
        io_corners angle;
        CHECK(!io_corners_parse((const char *[]){words}, 1, &angle, &st), "%s", st.message);
        lgd_rectified r;
        const double fov = io_fov_of_focal(320, 400, 300);
        CHECK(!lgd_rectify(path, &angle, 1 << 20, 48, fov, 1, &r, &st), "%s", st.message);
        double worst = 0;
        for (int j = 0; j < 48; j++)
            for (int i = 0; i < 48; i++)
                for (int k = 0; k < 3; k++) {
                    const double at[2] = {(i + 0.5) / 48 - 0.5, 0.5 - (j + 0.5) / 48};
                    worst = farther(worst, fabs((double)(r.square.data[(j * 48 + i) * 3 + k] - angled_pattern(at, k))));
                }
        CHECK(worst < 2e-3, "the square misses the pattern by %g", worst);
        for (int k = 0; k < 3; k++)
            CHECK(fabs((double)r.photo.camera[k] - camera.at[k]) < 1e-4, "camera %d: %g, not %g", k,
                  (double)r.photo.camera[k], camera.at[k]);
        /* as bright in the centre as under the default flash */
        const double d = 2, bright = (double)r.photo.power * r.photo.light[2] / (d * d * d);
        CHECK(fabs(bright / (double)(RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE)) - 1) < 1e-3, "%g",
              bright);
        CHECK(!r.assumed && strcmp(r.fov_from, "--fov") == 0, "%s", r.fov_from);
        io_image_free(&r.square);
        CHECK(!lgd_rectify(path, &angle, 1 << 20, 8, 0, 1, &r, &st) && r.assumed && strstr(r.fov_from, "no focal"),
              "a default field of view is not said to be one: %s", r.fov_from);
        io_image_free(&r.square);
    }
}

static void squeezed(const double point[2], double pixel[2], const void *user)
{
    (void)user;
    for (int k = 0; k < 2; k++) pixel[k] = 64 * point[k];
}

/* Stripes a pixel wide, shrunk eight times, are grey: nothing of them is left over. */
TEST(angle_shrinks_by_area)
{
    char path[512];
    ts_status st = {0};
    io_image stripes, square;
    io_photo_rows photo;
    CHECK(!io_image_create(&stripes, 64, 64, 3, &st), "%s", st.message);
    for (size_t i = 0; i < 64 * 64 * 3; i++) stripes.data[i] = i / 3 % 2 ? 1 : 0;
    snprintf(path, sizeof path, "%s/stripes.png", test_folder());
    CHECK(!io_write_png(path, &stripes, 8, true, &st), "%s", st.message);
    CHECK(!io_photo_open(path, 1 << 20, true, &photo, &st), "%s", st.message);
    CHECK(!io_warp(&photo, &(io_view_of){squeezed, NULL}, 8, 1, &square, &st), "%s", st.message);
    for (int i = 0; i < 8 * 8 * 3; i++)
        CHECK(fabsf(square.data[i] - 0.5f) < 1e-3f, "value %d is %g", i, (double)square.data[i]);
    io_photo_close(&photo);
    io_image_free(&stripes);
    io_image_free(&square);
}

/* A square of 560 pixels around the middle of 800, turned by *user. */
static void turned(const double point[2], double pixel[2], const void *user)
{
    const double turn = *(const double *)user, x = 560 * (point[0] - 0.5), y = 560 * (point[1] - 0.5);
    pixel[0] = 400 + x * cos(turn) - y * sin(turn);
    pixel[1] = 400 + x * sin(turn) + y * cos(turn);
}

/* Whichever corner of the square lies farthest out, the photograph is read up to it. */
TEST(angle_reads_up_to_every_corner)
{
    enum { SIDE = 800, SIZE = 280 };
    char path[512];
    ts_status st = {0};
    io_image ramps, square;
    io_photo_rows photo;
    CHECK(!io_image_create(&ramps, SIDE, SIDE, 3, &st), "%s", st.message);
    for (int i = 0; i < SIDE * SIDE; i++) {
        ramps.data[3 * i] = (float)(i % SIDE) / SIDE;
        ramps.data[3 * i + 1] = (float)(i / SIDE) / SIDE;
    }
    snprintf(path, sizeof path, "%s/ramps.png", test_folder());
    CHECK(!io_write_png(path, &ramps, 16, true, &st), "%s", st.message);
    CHECK(!io_photo_open(path, 1 << 20, true, &photo, &st), "%s", st.message);
    for (int turns = 0; turns < 8; turns++) {
        const double turn = turns * 0.78539816;
        double worst = 0;
        CHECK(!io_warp(&photo, &(io_view_of){turned, &turn}, SIZE, 1, &square, &st), "%s", st.message);
        for (int i = 0; i < SIZE * SIZE; i++) {
            double want[2];
            turned((double[2]){(i % SIZE + 0.5) / SIZE, (i / SIZE + 0.5) / SIZE}, want, &turn);
            for (int k = 0; k < 2; k++)
                worst = farther(worst, fabs((double)square.data[3 * i + k] - (want[k] - 0.5) / SIDE));
        }
        CHECK(worst < 1e-4, "turned by %d eighths: %g off", turns, worst);
        io_image_free(&square);
    }
    io_photo_close(&photo);
    io_image_free(&ramps);
}

TEST(angle_corners_that_cannot_be)
{
    const struct {
        const char *words, *says;
    } cases[] = {{"10,10 90,90 90,10 10,90", "cross"},        {"10,10 10,90 90,90 90,10", "counter-clockwise"},
                 {"10,10 50,50 90,90 10,90", "in a line"},    {"10,10 10,10 90,90 10,90", "in a line"},
                 {"-5,10 90,10 90,90 10,90", "outside"},      {"10,10 90,10 90,90", "3 corners"},
                 {"10,10 90,10 90,90 10,90 5,5", "four x,y"}, {"10,10 90,10 90,90 10", "four x,y"},
                 {"10,10 90,10 90,90 nan,1", "four x,y"},     {"", "0 corners"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        ts_status st = {0};
        io_corners angle;
        CHECK(io_corners_parse(&cases[i].words, 1, &angle, &st) == TS_INVALID && strstr(st.message, cases[i].says),
              "'%s': %s", cases[i].words, st.message);
    }
    char path[512];
    ts_status st = {0};
    lgd_rectified r;
    const io_corners beyond = {{{10, 10}, {500, 10}, {500, 90}, {10, 90}}};
    const io_pinhole camera = angled_camera(100, 100, 100, 1, 0, 0, 0);
    snprintf(path, sizeof path, "%s/small.png", test_folder());
    angled_write(path, &camera);
    CHECK(lgd_rectify(path, &beyond, 1 << 20, 8, 50, 1, &r, &st) == TS_INVALID && strstr(st.message, "corner 2") &&
              strstr(st.message, "small.png"),
          "%s", st.message);
    CHECK(!r.square.data && r.fov == 0 && !*r.fov_from && !*r.profile && !r.assumed, "something is left in it");
}

/* A capture.ini's corners, focal length and exposure. */
TEST(angle_in_a_capture)
{
    char path[512], ini[512], text[1024], corners[256];
    ts_status st = {0};
    io_capture c;
    const io_pinhole camera = angled_camera(400, 300, 320, 2, 30, 1, 0.1);
    double p[4][2];
    for (int k = 0; k < 4; k++) io_pinhole_see(&camera, angled_square[k], p[k]);
    snprintf(path, sizeof path, "%s/angled.png", test_folder());
    snprintf(ini, sizeof ini, "%s/capture.ini", test_folder());
    angled_write(path, &camera);
    snprintf(corners, sizeof corners, "%.4f,%.4f %.4f,%.4f %.4f,%.4f %.4f,%.4f", p[0][0], p[0][1], p[1][0], p[1][1],
             p[2][0], p[2][1], p[3][0], p[3][1]);
    const char *const form = "[capture]\nside = 2\n[a]\nfile = angled.png\ncorners = %s\nfocal = %.6f\n[b]\nfile = "
                             "angled.png\ncorners = %s\nfocal = 27\nexposure = 0.5\ncamera = 0, 0, 5\n";
    snprintf(text, sizeof text, form, corners, 320 / 500.0 * 43.266615305567875, corners);
    CHECK(!io_write_bytes(ini, text, strlen(text), &st), "%s", st.message);
    CHECK(!io_read_capture_ini(ini, 16, 5, 1 << 20, &c, &st), "%s", st.message);
    for (int k = 0; k < 3; k++) {
        CHECK(fabs((double)c.camera[0][k] - camera.at[k]) < 1e-4, "camera %d: %g, not %g", k, (double)c.camera[0][k],
              camera.at[k]);
        CHECK(c.light[0][k] == c.camera[0][k], "the light is not in the lens");
        CHECK(c.camera[1][k] == (k == 2 ? 2.5f : 0), "a camera that is given is not taken");
    }
    for (int i = 0; i < 16 * 16 * 3; i++) {
        const double at[2] = {(i / 3 % 16 + 0.5) / 16 - 0.5, 0.5 - (i / 48 + 0.5) / 16};
        CHECK(fabsf(c.image[i] - angled_pattern(at, i % 3)) < 0.01f, "value %d: %g", i, (double)c.image[i]);
        CHECK(fabsf(c.image[16 * 16 * 3 + i] - 2 * c.image[i]) < 1e-5f, "half the exposure does not count twice");
    }
    io_capture_free(&c);
    static const struct {
        const char *more, *says;
    } wrong[] = {{"corners = 1,1 2,2\n", "a.corners"},
                 {"corners = 0,0 900,0 900,90 0,90\nfocal = 26\n", "outside"},
                 {"corners = 0,0 90,0 90,90 0,90\n", "focal = 26"},
                 {"focal = 26\nlight = 0, 0, 1\ncamera = 0, 0, 1\n", "has no corners"},
                 {"exposure = 0\n", "above 0"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        snprintf(text, sizeof text, "[a]\nfile = angled.png\n%s", wrong[i].more);
        CHECK(!io_write_bytes(ini, text, strlen(text), &st), "%s", st.message);
        CHECK(io_read_capture_ini(ini, 16, 5, 1 << 20, &c, &st) && strstr(st.message, wrong[i].says), "case %zu: %s", i,
              st.message);
        st = (ts_status){0};
    }
}
