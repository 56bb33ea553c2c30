/* The model for photographs, phone: laws of plain surfaces that any good estimate keeps. */
#include "infer/lgd.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, PIXELS = SIDE * SIDE };

/* Maps of a plain surface, photographed with its flash from so many sides away, so bright as from the usual place.
 */
static void plain(const float diffuse[3], float f0, float roughness, float distance, float *maps, float *image)
{
    rd_view view = rd_flash();
    view.power *= (distance / view.light[2]) * (distance / view.light[2]);
    view.light[2] = view.camera[2] = distance;
    for (int p = 0; p < PIXELS; p++) {
        float *m = maps + p * MAP_CHANNELS;
        for (int c = 0; c < 3; c++) m[MAP_DIFFUSE + c] = 2 * diffuse[c] - 1, m[MAP_SPECULAR + c] = 2 * f0 - 1;
        m[MAP_NORMAL] = m[MAP_NORMAL + 1] = 0;
        m[MAP_ROUGHNESS] = 2 * roughness - 1;
    }
    rd_render(rd_grid_full(SIDE), maps, MAP_CHANNELS, &view, true, image);
}

/* Colours that training's palettes do not have beside those that they have. */
TEST(phone_keeps_hues)
{
    static const float colours[][3] = {{0.6f, 0.02f, 0.2f},  {0.02f, 0.1f, 0.5f}, {0.05f, 0.4f, 0.4f},
                                       {0.25f, 0.5f, 0.05f}, {0.5f, 0.35f, 0.2f}, {0.4f, 0.4f, 0.4f}};
    float *maps = malloc(sizeof *maps * PIXELS * MAP_CHANNELS), *image = malloc(sizeof *image * PIXELS * 3);
    lgd_error e;
    lgd_model *model = lgd_load("models/phone.safetensors", &e);
    CHECK(model, "%s", e.message);
    double power;
    lgd_options o = lgd_options_default();
    o.power = &power;
    o.fov = LGD_FOV_UNKNOWN;
    for (int i = 0; i < (int)(sizeof colours / sizeof *colours); i++) {
        double mean[3] = {0, 0, 0}, sum = 0, relief = 0;
        plain(colours[i], 0.04f, i % 2 ? 0.35f : 0.6f, i % 3 ? 1 : 1.8f, maps, image);
        CHECK(!lgd_estimate(model, image, SIDE, &o, maps, &e), "%s", e.message);
        for (int p = 0; p < PIXELS; p++) {
            const float *m = maps + p * MAP_CHANNELS;
            for (int c = 0; c < 3; c++) mean[c] += (double)m[MAP_DIFFUSE + c];
            relief += pow((double)m[MAP_NORMAL], 2) + pow((double)m[MAP_NORMAL + 1], 2);
        }
        for (int c = 0; c < 3; c++) sum += mean[c];
        const double of = (double)(colours[i][0] + colours[i][1] + colours[i][2]);
        printf("  colour %d: shares %.2f %.2f %.2f, relief %.3f, power %.2f\n", i, mean[0] / sum, mean[1] / sum,
               mean[2] / sum, sqrt(relief / PIXELS), power);
        for (int c = 0; c < 3; c++)
            CHECK(fabs(mean[c] / sum - (double)colours[i][c] / of) < 0.1,
                  "colour %d: channel %d has %.2f of it, not %.2f", i, c, mean[c] / sum, (double)colours[i][c] / of);
        CHECK(sqrt(relief / PIXELS) < 0.05, "colour %d: relief %.3f of a plain surface", i, sqrt(relief / PIXELS));
    }
    lgd_free(&model);
    free(maps), free(image);
}

static int last_rmse(int step, double rmse, void *user)
{
    (void)step;
    if (rmse >= 0) *(double *)user = rmse;
    return 0;
}

/* The rendering under light, camera and ambient light as they were taken is as far from the photograph as is said. */
TEST(phone_says_what_light_it_found)
{
    static const float colour[3] = {0.4f, 0.3f, 0.2f};
    float *maps = malloc(sizeof *maps * PIXELS * MAP_CHANNELS), *image = malloc(sizeof *image * PIXELS * 3),
          *seen = malloc(sizeof *seen * PIXELS * 3);
    lgd_error e;
    lgd_model *model = lgd_load("models/phone.safetensors", &e);
    CHECK(model, "%s", e.message);
    plain(colour, 0.04f, 0.5f, 1, maps, image);
    for (int i = 0; i < PIXELS * 3; i++) image[i] = fminf(image[i] + 0.1f * (0.04f + 0.96f * colour[i % 3]), 1);
    double power, rmse = 0, ambient = 0, sums[2] = {0, 0};
    lgd_photo taken;
    lgd_options o = lgd_options_default();
    o.power = &power, o.taken = &taken, o.ambient = &ambient, o.progress = last_rmse, o.user = &rmse;
    CHECK(!lgd_estimate(model, image, SIDE, &o, maps, &e), "%s", e.message);
    CHECK(!lgd_render(maps, SIDE, taken.light, taken.camera, taken.power, seen, &e), "%s", e.message);
    for (int with = 0; with < 2; with++) {
        for (int i = 0; i < PIXELS * 3; i++) {
            const float *m = maps + i / 3 * MAP_CHANNELS + i % 3, f0 = m[MAP_SPECULAR];
            const double around = with ? ambient * (double)(f0 + (1 - f0) * m[MAP_DIFFUSE]) : 0;
            sums[with] += pow(fmin((double)seen[i] + around, 1) - (double)image[i], 2);
        }
        sums[with] = sqrt(sums[with] / (PIXELS * 3));
    }
    printf("  %.5f reported, %.5f rendered, without the ambient light of %.4f %.5f\n", rmse, sums[1], ambient, sums[0]);
    CHECK(fabs(rmse - sums[1]) < 1e-4, "%.5f is reported, %.5f rendered", rmse, sums[1]);
    CHECK(ambient > 0.01 && sums[0] > 1.2 * sums[1], "ambient light of %g makes no difference: %g", ambient, sums[0]);
    lgd_free(&model);
    lgd_model *other = lgd_load("models/single.safetensors", &e);
    CHECK(other && !lgd_estimate(other, image, SIDE, &o, maps, &e) && ambient == 0, "single finds ambient light: %g",
          ambient);
    lgd_free(&other);
    free(maps), free(image), free(seen);
}

static double mean_f0(const float *maps)
{
    double sum = 0;
    for (int p = 0; p < PIXELS; p++)
        for (int c = 0; c < 3; c++) sum += (double)maps[p * MAP_CHANNELS + MAP_SPECULAR + c] / 3;
    return sum / PIXELS;
}

/* What somebody says of a sample holds, whatever one photograph looks like; models without a scene cannot be told. */
TEST(phone_takes_a_sample_for_what_it_is_told)
{
    float *maps = malloc(sizeof *maps * PIXELS * MAP_CHANNELS), *image = malloc(sizeof *image * PIXELS * 3);
    lgd_error e;
    lgd_model *model = lgd_load("models/phone.safetensors", &e), *other = lgd_load("models/single.safetensors", &e);
    CHECK(model && other, "%s", e.message);
    double power, f0[3];
    for (int metal = 0; metal < 2; metal++) {
        const float grey = metal ? 0.01f : 0.5f, colour[] = {grey, grey, grey};
        for (int sample = LGD_SAMPLE_UNKNOWN; sample <= LGD_SAMPLE_METAL; sample++) {
            lgd_options o = lgd_options_default();
            o.power = &power, o.sample = sample;
            plain(colour, metal ? 0.6f : 0.04f, 0.4f, 1, maps, image);
            CHECK(!lgd_estimate(model, image, SIDE, &o, maps, &e), "%s", e.message);
            f0[sample] = mean_f0(maps);
        }
        printf("  F0 %.3f, of a dielectric %.3f, of a metal %.3f\n", f0[0], f0[1], f0[2]);
        CHECK(f0[LGD_SAMPLE_DIELECTRIC] < 0.1, "a dielectric's F0 is %.3f", f0[LGD_SAMPLE_DIELECTRIC]);
        CHECK(f0[LGD_SAMPLE_METAL] > 0.2, "a metal's F0 is %.3f", f0[LGD_SAMPLE_METAL]);
    }
    lgd_options o = lgd_options_default();
    o.sample = LGD_SAMPLE_METAL;
    CHECK(lgd_estimate(other, image, SIDE, &o, maps, &e) && strstr(e.message, "what the sample is"), "%s", e.message);
    o.sample = 3;
    CHECK(lgd_estimate(model, image, SIDE, &o, maps, &e) && strstr(e.message, "sample is 3"), "%s", e.message);
    lgd_free(&model), lgd_free(&other);
    free(maps), free(image);
}
