/* What rd_render, the flash loss, the views and the tone curves promise. */
#include "data/material.h"
#include "render/tone.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/shading.h"
#include <dirent.h>
#include <math.h>
#include <string.h>

/* Smooth maps with some of everything. */
static void soft_maps(int side, int repeat, int channels, float *maps)
{
    for (int p = 0; p < side * side; p++) {
        double x = (p % side / repeat + 0.5) * repeat / side, y = (p / side / repeat + 0.5) * repeat / side;
        float *m = maps + p * channels;
        for (int c = 0; c < 3; c++) {
            m[MAP_DIFFUSE + c] = (float)(0.5 * sin(7 * x + c) * cos(5 * y) - 0.2);
            m[MAP_SPECULAR + c] = (float)(0.3 * cos(4 * x - 3 * y + c) - 0.4);
        }
        m[MAP_NORMAL] = (float)(0.3 * sin(9 * x + 2 * y));
        m[MAP_NORMAL + 1] = (float)(0.25 * cos(8 * y - x));
        m[MAP_ROUGHNESS] = (float)(0.3 * sin(6 * x * y) + 0.1);
        for (int c = C; c < channels; c++) m[c] = 0.5f;
    }
}

TEST(render_flash_gradient_is_the_scaled_derivative)
{
    enum { SIDE = 256 };
    float *maps = floats(SIDE * SIDE * C), *image = floats(SIDE * SIDE * 3), *gradient = floats(SIDE * SIDE * C);
    rd_grid grid = rd_grid_full(SIDE);
    rd_view view = rd_flash();
    ts_rng rng = ts_rng_make(7, TS_STREAM_TEST, 0);
    soft_maps(SIDE, 1, C, maps);
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = ts_rng_uniform(&rng);
    double rmse, again, squares = 0;
    rd_flash_rmse(grid, maps, C, &view, image, &rmse);
    rd_flash_gradient(grid, maps, C, &view, image, rmse, gradient, &again);
    CHECK(rmse == again, "two RMSEs");
    for (int p = 0; p < SIDE * SIDE; p++) {
        double m[C], point[2], value[3];
        to_double(maps + p * C, m);
        rd_centre(grid, p % SIDE, p / SIDE, point);
        rd_radiance(m, point, &view, value, NULL);
        for (int c = 0; c < 3; c++) squares += pow(fmin(value[c], 1) - (double)image[p * 3 + c], 2);
    }
    double n = 3.0 * SIDE * SIDE;
    CHECK(fabs(rmse - sqrt(squares / n)) < 1e-6 * rmse, "RMSE %.9g instead of %.9g", rmse, sqrt(squares / n));
    int clamped = 0;
    for (int t = 0; t < 400; t++) {
        int p = ts_rng_int(&rng, SIDE * SIDE);
        if (t >= 300)
            p = (SIDE / 2 + ts_rng_int(&rng, 9) - 4) * SIDE + SIDE / 2 + ts_rng_int(&rng, 9) - 4; /* in the highlight */
        double m[C], point[2], at[3];
        to_double(maps + p * C, m);
        rd_centre(grid, p % SIDE, p / SIDE, point);
        rd_radiance(m, point, &view, at, NULL);
        bool near_one = false;
        for (int c = 0; c < 3; c++) clamped += at[c] > 1, near_one |= fabs(at[c] - 1) < 1e-3;
        if (near_one) continue;
        for (int i = 0; i < C; i++) {
            double h = 1e-5, keep = m[i], side[2], largest = 0;
            for (int j = 0; j < C; j++) largest = farther(largest, fabs((double)gradient[p * C + j]));
            for (int k = 0; k < 2; k++) {
                double value[3], sum = squares;
                m[i] = keep + (k ? h : -h);
                rd_radiance(m, point, &view, value, NULL);
                for (int c = 0; c < 3; c++) {
                    double was = fmin(at[c], 1) - (double)image[p * 3 + c],
                           is = fmin(value[c], 1) - (double)image[p * 3 + c];
                    sum += (is - was) * (is + was);
                }
                side[k] = sqrt(sum / n);
            }
            m[i] = keep;
            double expected = 1e5 * (side[1] - side[0]) / (2 * h), got = (double)gradient[p * C + i];
            CHECK(fabs(got - expected) <= 1e-3 * largest + 1e-4, "pixel %d channel %d: %.6g instead of %.6g", p, i, got,
                  expected);
        }
    }
    printf("%d clamped colours\n", clamped);
    free(maps), free(image), free(gradient);
}

/* Pixels of half the size with the same maps get the same gradient, up to where their centres moved. */
TEST(render_flash_gradient_does_not_depend_on_resolution)
{
    enum { SIDE = 64, BIG = 2 * SIDE };
    float *maps = floats(BIG * BIG * C), *image = floats(BIG * BIG * 3), *small = floats(SIDE * SIDE * C),
          *big = floats(BIG * BIG * C);
    rd_view view = rd_flash();
    view.power *= 0.3f; /* nothing is clamped: where the clamp begins, the gradient jumps between neighbouring pixels */
    double rmse[2], error = 0, size = 0;
    soft_maps(SIDE, 1, C, maps);
    for (int i = 0; i < BIG * BIG * 3; i++) image[i] = 0.2f;
    rd_flash_gradient(rd_grid_full(SIDE), maps, C, &view, image, 0.1, small, &rmse[0]);
    soft_maps(BIG, 2, C, maps);
    rd_flash_gradient(rd_grid_full(BIG), maps, C, &view, image, 0.1, big, &rmse[1]);
    CHECK(fabs(rmse[0] - rmse[1]) < 0.01 * rmse[0], "RMSE %g and %g", rmse[0], rmse[1]);
    for (int p = 0; p < SIDE * SIDE; p++)
        for (int i = 0; i < C; i++) {
            double mean = 0;
            for (int k = 0; k < 4; k++)
                mean += 0.25 * (double)big[((p / SIDE * 2 + k / 2) * BIG + p % SIDE * 2 + k % 2) * C + i];
            error += pow(mean - (double)small[p * C + i], 2);
            size += pow((double)small[p * C + i], 2);
        }
    CHECK(size > 0 && error < 1e-3 * size, "gradients differ by %g of their size", sqrt(error / size));
    free(maps), free(image), free(small), free(big);
}

TEST(render_tiles_and_threads_give_the_same_bytes)
{
    enum { SIDE = 61, CH = 10 };
    float *maps = floats(SIDE * SIDE * CH), *image = floats(SIDE * SIDE * 3), *gradient = floats(SIDE * SIDE * CH),
          *other = floats(SIDE * SIDE * CH), *tile = floats(SIDE * SIDE * CH), *part = floats(SIDE * SIDE * 3),
          *photo = floats(SIDE * SIDE * 3);
    soft_maps(SIDE, 1, CH, maps);
    for (int i = 0; i < SIDE * SIDE; i += 7)
        maps[i * CH + MAP_NORMAL] *= 5; /* some in the guard, among others that are not */
    ts_rng rng = ts_rng_make(8, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * 3; i++) photo[i] = ts_rng_uniform(&rng);
    rd_grid full = rd_grid_full(SIDE);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++)
        for (int k = 0; k < 4; k++) {
            static const int kinds[4] = {0, RD_LOSS_DIFFUSE, RD_LOSS_VIEWS, RD_LOSS_VIEWS + 1};
            ts_isa_use((ts_isa)isa);
            rd_view view = any_view(&rng, kinds[k]);
            double rmse, again;
            ts_threads_set(1);
            rd_render(full, maps, CH, &view, true, image);
            rd_flash_gradient(full, maps, CH, &view, photo, 0.1, gradient, &rmse);
            for (int threads = 2; threads <= 5; threads += 3) {
                ts_threads_set(threads);
                rd_render(full, maps, CH, &view, true, part);
                rd_flash_gradient(full, maps, CH, &view, photo, 0.1, other, &again);
                bool same = rmse == again && !memcmp(image, part, sizeof(float) * SIDE * SIDE * 3);
                CHECK(same && !memcmp(gradient, other, sizeof(float) * SIDE * SIDE * CH),
                      "%d threads give other bytes than one", threads);
            }
            ts_threads_set(1);
            for (int t = 0; t < 6; t++) {
                rd_grid g = {.h = 1 + ts_rng_int(&rng, SIDE), .w = 1 + ts_rng_int(&rng, SIDE), .side = SIDE};
                g.y0 = ts_rng_int(&rng, SIDE - g.h + 1), g.x0 = ts_rng_int(&rng, SIDE - g.w + 1);
                for (int y = 0; y < g.h; y++)
                    memcpy(tile + y * g.w * CH, maps + ((g.y0 + y) * SIDE + g.x0) * CH,
                           (size_t)(g.w * CH) * sizeof(float));
                rd_render(g, tile, CH, &view, true, part);
                for (int y = 0; y < g.h; y++) {
                    const float *whole = image + ((g.y0 + y) * SIDE + g.x0) * 3;
                    CHECK(!memcmp(part + y * g.w * 3, whole, (size_t)(g.w * 3) * sizeof(float)),
                          "a tile differs from the whole");
                }
            }
        }
    free(maps), free(image), free(gradient), free(other), free(tile), free(part), free(photo);
}

TEST(render_no_light_from_below)
{
    float maps[C] = {1, 1, 1, 0, 0, 0, 1, 1, 1}, image[3];
    rd_grid one = rd_grid_full(1);
    for (int k = 0; k < 2; k++) {
        rd_view view = rd_flash();
        rd_render(one, maps, C, &view, false, image);
        CHECK(image[0] > 0, "the flash lights nothing");
        (k ? view.light : view.camera)[2] *= -1;
        rd_render(one, maps, C, &view, false, image);
        CHECK(image[0] == 0 && image[1] == 0 && image[2] == 0, "radiance %g from below", (double)image[0]);
    }
}

/* A white diffuse plane at (0, 0) under the flash has radiance P / (pi d^2), and clamp means at most 1. */
TEST(render_known_values)
{
    float maps[C] = {1, 1, 1, 0, 0, 1, -1, -1, -1}, image[3];
    rd_view view = rd_flash();
    double d = 250 / 256.0, expected = 329288.0 / 65536 / (3.14159265358979 * d * d), value[3], m[C], point[2] = {0, 0};
    rd_render(rd_grid_full(1), maps, C, &view, false, image);
    to_double(maps, m);
    rd_radiance(m, point, &view, value, NULL);
    /* F0 = 0: what is left of the mirror at normal incidence is 2^-12.54 / (4 pi) of the light */
    double mirror = exp2(-5.55473 - 6.98316) / 4;
    CHECK(fabs((double)image[0] - expected * (1 + mirror)) < 1e-6 * expected, "%.9g instead of %.9g", (double)image[0],
          expected * (1 + mirror));
    CHECK(fabs(value[0] - expected * (1 + mirror)) < 1e-12, "reference %.15g instead of %.15g", value[0],
          expected * (1 + mirror));
    rd_render(rd_grid_full(1), maps, C, &view, true, image);
    CHECK(image[0] == 1, "not clamped: %g", (double)image[0]);
    /* constant directions: radiance = f pi n.l / l_z */
    view = (rd_view){.kind = RD_DIRECTIONS, .light = {0, 0.6f, 0.8f}, .camera = {0, 0, 1}};
    maps[MAP_SPECULAR] = 1; /* red has no diffuse part */
    rd_render(rd_grid_full(1), maps, C, &view, false, image);
    CHECK(fabsf(image[1] - 1) < 0.1f && image[0] > 0 && image[0] < 1, "directions: %g %g", (double)image[0],
          (double)image[1]);
}

/* A camera farther away sees the same middle, and the sample under the same angle back and forth. */
TEST(render_view_from_farther)
{
    const rd_view near = rd_flash(), same = rd_view_from(near, (double)RD_FLASH_DISTANCE);
    CHECK(!memcmp(&near, &same, sizeof near), "the default distance changes the default view");
    CHECK(fabs(rd_fov_of((double)RD_FLASH_DISTANCE) - 54.2249) < 1e-4, "%g degrees",
          rd_fov_of((double)RD_FLASH_DISTANCE));
    static const float diffuse[9] = {0.5f, 0.2f, -0.4f, 0, 0, 0.9f, -1, -1, -1};
    float a[3], b[3];
    for (int degrees = 5; degrees < 170; degrees += 11) {
        const double d = rd_fov_distance(degrees);
        const rd_view far = rd_view_from(near, d);
        CHECK(fabs(rd_fov_of(d) - degrees) < 1e-9, "%d degrees became %g", degrees, rd_fov_of(d));
        CHECK(far.camera[2] == (float)d && far.light[2] == (float)d, "%g high", (double)far.camera[2]);
        rd_render(rd_grid_full(1), diffuse, 9, &near, false, a);
        rd_render(rd_grid_full(1), diffuse, 9, &far, false, b);
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(a[c] - b[c]) < 1e-5f, "%d degrees: %g in the middle, not %g", degrees, (double)b[c],
                  (double)a[c]);
    }
}

/* A camera on a circle over the sample, and what is matt as bright in the middle as before. */
TEST(render_view_tilted)
{
    const rd_view near = rd_flash(), same = rd_view_tilted(near, 0);
    CHECK(!memcmp(&near, &same, sizeof near), "no tilt changes the default view");
    static const float matt[9] = {0.5f, 0.2f, -0.4f, 0, 0, 0.9f, -1, -1, -1};
    float a[3], b[3];
    for (int degrees = 5; degrees < 70; degrees += 13) {
        const double d = rd_fov_distance(40), turn = degrees * 0.017453292519943295;
        const rd_view straight = rd_view_from(near, d), view = rd_view_tilted(straight, degrees);
        CHECK(fabs((double)view.camera[2] - d * cos(turn)) < 1e-6 &&
                  fabs((double)view.camera[1] + d * sin(turn)) < 1e-6,
              "%d degrees: at %g, %g", degrees, (double)view.camera[1], (double)view.camera[2]);
        CHECK(!memcmp(view.camera, view.light, sizeof view.light), "%d degrees: the light has left the lens", degrees);
        CHECK(fabs(rd_fov_from(view.camera) - 40) < 1e-5, "%d degrees: the field of view became %g", degrees,
              rd_fov_from(view.camera));
        rd_render(rd_grid_full(1), matt, 9, &straight, false, a);
        rd_render(rd_grid_full(1), matt, 9, &view, false, b);
        /* F of F0 = 0 is not quite 0, and its share grows with the angle */
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(a[c] - b[c]) < 1e-4f * a[c], "%d degrees: %g in the middle, not %g", degrees, (double)b[c],
                  (double)a[c]);
    }
}

TEST(render_views)
{
    ts_rng rng = ts_rng_make(9, TS_STREAM_TEST, 0);
    double r2 = 0, logs = 0;
    enum { ROUNDS = 2000 };
    for (int i = 0; i < ROUNDS; i++) {
        rd_view views[RD_LOSS_VIEWS], eval[3];
        rd_loss_views(&rng, views);
        for (int k = 0; k < RD_LOSS_VIEWS; k++) {
            const rd_view *v = &views[k];
            CHECK(v->kind == (k < RD_LOSS_DIFFUSE ? RD_DIRECTIONS : RD_NEAR) && v->light[2] > 0 && v->camera[2] > 0,
                  "view %d", k);
            if (k < RD_LOSS_DIFFUSE) {
                double x = (double)v->light[0], y = (double)v->light[1], z = (double)v->light[2];
                CHECK(fabs(x * x + y * y + z * z - 1) < 1e-6 && x * x + y * y < 0.951 && x * x + y * y > 0.0099,
                      "light %g %g %g", x, y, z);
                r2 += (x * x + y * y) / (RD_LOSS_DIFFUSE * ROUNDS);
            } else { /* the common point p: light - p and camera - p mirror each other, so their heights above it are as
                        their sides */
                double hl = (double)v->light[2] - 0.5e-4, hv = (double)v->camera[2] - 0.5e-4, t = hl / (hl + hv);
                for (int j = 0; j < 2; j++) {
                    double at = (double)v->light[j] + t * ((double)v->camera[j] - (double)v->light[j]);
                    CHECK(fabs(at) <= 0.5 + 1e-5, "the mirrored pair meets at %g", at);
                }
            }
        }
        rd_eval_views(&rng, 3, eval);
        for (int k = 0; k < 3; k++) {
            CHECK(eval[k].kind == RD_POINT, "evaluation's kind");
            CHECK(eval[k].light[2] == RD_FLASH_DISTANCE && eval[k].camera[2] == RD_FLASH_DISTANCE,
                  "evaluation's heights");
            CHECK(fabsf(eval[k].light[0]) <= 0.5f && fabsf(eval[k].camera[1]) <= 0.5f, "evaluation's square");
        }
        logs += fabs((double)(eval[0].light[0] - eval[1].light[0])) / ROUNDS;
    }
    CHECK(fabs(r2 - 0.48) < 0.02, "mean r^2 %g instead of 0.48", r2);
    CHECK(fabs(logs - 1 / 3.0) < 0.02, "mean distance of two uniform positions %g instead of 1/3", logs);
    for (int i = 0; i < 4; i++) {
        rd_view a = rd_preview_view(i, 4), b = rd_preview_view((i + 1) % 4, 4);
        CHECK(a.camera[2] == RD_FLASH_DISTANCE && (a.light[0] != b.light[0] || a.light[1] != b.light[1]), "preview");
    }
}

/* A phone over the sample: a matt sample's middle is as bright as under the default flash where it stands straight
 * above; every other light is at the camera. */
TEST(render_flash_views)
{
    enum { ROUNDS = 2000, COUNT = 4 };
    ts_rng rng = ts_rng_make(10, TS_STREAM_TEST, 0);
    double heights = 0, apart = 0;
    for (int i = 0; i < ROUNDS; i++) {
        rd_view views[COUNT];
        rd_flash_views(&rng, COUNT, views);
        for (int k = 0; k < COUNT; k++) {
            const rd_view *v = &views[k];
            const double farther = (double)(v->camera[2] / RD_FLASH_DISTANCE);
            CHECK(v->kind == RD_POINT && v->ambient == 0 && v->light[2] == v->camera[2], "view %d", k);
            CHECK(farther >= 1 && farther <= 2.7183, "%g times the distance", farther);
            CHECK(fabs((double)(v->power / RD_FLASH_POWER) - farther * farther) < 1e-5, "power %g", (double)v->power);
            for (int j = 0; j < 2; j++) {
                CHECK(fabsf(v->camera[j]) <= 0.5f && fabsf(v->light[j]) <= 0.5f, "beside the patch");
                if (k % 2) apart += fabs((double)(v->light[j] - v->camera[j])) / (COUNT * ROUNDS);
                else CHECK(v->light[j] == v->camera[j], "view %d: the light is not at the camera", k);
            }
            heights += log(farther) / (COUNT * ROUNDS);
        }
    }
    CHECK(fabs(heights - 0.5) < 0.02, "mean logarithm of the height %g instead of 1/2", heights);
    CHECK(fabs(apart - 1 / 3.0) < 0.02, "mean distance of two uniform places %g instead of 1/3", apart);
}

TEST(render_tone)
{
    enum { N = 40001 };
    float *x = floats(N), *y = floats(N);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < N; i++) x[i] = (float)i / (N - 5) - 1e-5f;
        x[7] = NAN, x[8] = INFINITY, x[9] = -1e30f;
        rd_log_encode(N, x, y, 0);
        for (int i = 0; i < N; i++) {
            double v = x[i] > 0 ? x[i] < 1 ? (double)x[i] : 1 : 0,
                   expected = 2 * (log(v + 0.01) - log(0.01)) / (log(1.01) - log(0.01)) - 1;
            CHECK(fabs((double)y[i] - expected) < 1e-6, "log encoding of %g is %.9g instead of %.9g", (double)x[i],
                  (double)y[i], expected);
        }
        rd_log_encode(N, x, x, 0);
        CHECK(!memcmp(x, y, N * sizeof *x), "in place differs");
    }
    CHECK(rd_gamma(0) == 0 && rd_gamma(1) == 1 && rd_gamma(5) == 1 && rd_gamma(-2) == 0 && rd_gamma(NAN) == 0,
          "gamma is clamped");
    CHECK(fabsf(rd_gamma(0.5f) - 0.72974f) < 1e-5f, "gamma of a half: %g", (double)rd_gamma(0.5f));
    free(x), free(y);
}

/* Correlation of two images as one looks at them. */
static double correlation(size_t count, const float *a, const float *b)
{
    double sa = 0, sb = 0, aa = 0, bb = 0, ab = 0, n = (double)count;
    for (size_t i = 0; i < count; i++) {
        double x = (double)rd_gamma(a[i]), y = (double)rd_gamma(b[i]);
        sa += x, sb += y, aa += x * x, bb += y * y, ab += x * y;
    }
    return (ab / n - sa / n * (sb / n)) / sqrt((aa / n - sa / n * (sa / n)) * (bb / n - sb / n * (sb / n)));
}

/* Strips begin with a flash rendering of their maps by their authors, with a light and camera of their own choice: not
 * the same picture, but alike, and less so when an axis of the normals is turned round. */
TEST(render_strips_look_like_their_photographs)
{
    char folder[512], path[1024];
    snprintf(folder, sizeof folder, "%s/strips", test_data());
    DIR *dir = opendir(folder);
    if (!dir) test_skip("no %s", folder);
    double sum[3] = {0}; /* as it is, y turned, x turned */
    int strips = 0;
    for (struct dirent *f; (f = readdir(dir));) {
        if (!strstr(f->d_name, ".png")) continue;
        snprintf(path, sizeof path, "%s/%s", folder, f->d_name);
        ts_status st = {0};
        io_material m;
        io_image photo;
        CHECK(io_read_strip(path, 0, &m, &photo, &st) == TS_OK, "%s", st.message);
        size_t count = (size_t)m.size * (size_t)m.size;
        float *image = floats(count * 3);
        rd_view flash = rd_flash();
        strips++;
        for (int turn = 0; turn < 3; turn++) {
            for (size_t i = 0; turn && i < count; i++) {
                float *n = m.maps + i * C + MAP_NORMAL;
                n[1] *= -1; /* the second time: back */
                if (turn == 2) n[0] *= -1;
            }
            rd_render(rd_grid_full(m.size), m.maps, C, &flash, true, image);
            double r = correlation(count * 3, image, photo.data);
            sum[turn] += r;
            CHECK(turn || r > 0.6, "%s: correlation %.3f", f->d_name, r);
        }
        free(image);
        io_material_free(&m);
        io_image_free(&photo);
    }
    closedir(dir);
    CHECK(strips > 0, "%s is empty", folder);
    printf("correlation %.3f; with y turned %.3f, with x turned %.3f\n", sum[0] / strips, sum[1] / strips,
           sum[2] / strips);
    CHECK(sum[0] / strips > 0.8 && sum[0] > 1.05 * sum[1] && sum[0] > 1.05 * sum[2],
          "mean correlation %.3f; with y turned %.3f, with x turned %.3f", sum[0] / strips, sum[1] / strips,
          sum[2] / strips);
}
