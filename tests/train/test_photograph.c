/* The photographs that training sees: one under the flash, or several under the configurations of a capture. */
#include "data/camera.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include "train/state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 24, COUNT = 3, NUMBER = 5, PIXELS = SIZE * SIZE };
static float maps[COUNT][PIXELS * MAP_CHANNELS], one[COUNT][PIXELS * 3], many[COUNT][NUMBER][PIXELS * 3],
    again[COUNT][NUMBER][PIXELS * 3];

static void make(void)
{
    io_procedural p = {.seed = 2};
    for (int i = 0; i < COUNT; i++) {
        io_material m = {.size = SIZE, .maps = maps[i]};
        io_procedural_make(&p, (uint64_t)i, &m);
    }
}

static tr_config without_faults(void)
{
    tr_config c = tr_config_default();
    c.data.noise = c.data.noise_spread = c.data.blur = c.data.exposure = c.data.vignette = c.data.white_balance =
        c.data.tilt = c.data.off_centre = 0;
    c.data.quantise = false;
    c.data.jpeg = 0;
    return c;
}

TEST(capture_has_nine_different_lights_and_begins_with_the_flash)
{
    const rd_view flash = rd_flash(), first = rd_capture_view(0);
    CHECK(!memcmp(first.light, flash.light, sizeof flash.light) && first.power == flash.power,
          "configuration 0 is not the flash");
    float sum[2] = {0};
    for (int i = 0; i < RD_CAPTURE_VIEWS; i++) {
        const rd_view a = rd_capture_view(i);
        CHECK(a.kind == RD_POINT && a.light[2] == RD_FLASH_DISTANCE && !memcmp(a.camera, flash.camera, sizeof a.camera),
              "configuration %d", i);
        for (int k = 0; k < 2; k++) sum[k] += a.light[k];
        for (int j = 0; j < i; j++) {
            const rd_view b = rd_capture_view(j);
            CHECK(hypotf(a.light[0] - b.light[0], a.light[1] - b.light[1]) > 0.59f,
                  "configurations %d and %d have one light", i, j);
        }
    }
    CHECK(sum[0] == 0 && sum[1] == 0 && rd_capture_view(1).light[0] > 0 && rd_capture_view(3).light[1] > 0,
          "they are not around the centre");
}

/* Its number, by its light. */
static int configuration(const rd_view *v)
{
    for (int i = 0; i < RD_CAPTURE_VIEWS; i++) {
        const rd_view c = rd_capture_view(i);
        if (!memcmp(c.light, v->light, sizeof c.light)) return i;
    }
    CHECK(false, "a light at %g, %g", (double)v->light[0], (double)v->light[1]);
    return 0;
}

TEST(capture_draws_the_flash_and_every_subset_of_the_others_alike)
{
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, 0);
    int seen[RD_CAPTURE_VIEWS] = {0};
    for (int trial = 0; trial < 3600; trial++) {
        rd_view views[RD_CAPTURE_VIEWS];
        int mask = 0;
        const int count = 1 + trial % RD_CAPTURE_VIEWS;
        rd_capture_draw(&r, count, views);
        for (int i = 0; i < count; i++) {
            const int c = configuration(&views[i]);
            CHECK(!(mask >> c & 1) && (c == 0) == (i == 0), "configuration %d comes as number %d", c, i);
            mask |= 1 << c;
            seen[c]++;
        }
    }
    for (int i = 1; i < RD_CAPTURE_VIEWS; i++)
        CHECK(abs(seen[i] - 1800) < 150, "configuration %d was drawn %d times", i, seen[i]);
}

TEST(photographs_are_the_clamped_renderings_without_faults)
{
    make();
    const tr_config c = without_faults();
    rd_view views[COUNT][NUMBER];
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < NUMBER; k++) views[i][k] = rd_capture_view((3 * i + 2 * k) % RD_CAPTURE_VIEWS);
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, many[0][0], NULL);
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < NUMBER; k++) {
            rd_render(rd_grid_full(SIZE), maps[i], MAP_CHANNELS, &views[i][k], true, one[0]);
            CHECK(!memcmp(one[0], many[i][k], sizeof one[0]), "photograph %d of material %d is another", k, i);
        }
}

TEST(photographs_under_the_flash_are_the_single_ones)
{
    make();
    const tr_config c = tr_config_default();
    rd_view flash[COUNT];
    for (int i = 0; i < COUNT; i++) flash[i] = rd_flash();
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], NULL, 1, one[0], NULL);
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], flash, 1, many[0][0], NULL);
    CHECK(!memcmp(one, many[0], sizeof one), "one flash photograph of each differs from the flash's own");
    tr_photographs(&c, 1, 9, 1, SIZE, maps[2], NULL, 1, many[0][0], NULL);
    CHECK(!memcmp(one[2], many[0][0], sizeof one[2]), "a photograph depends on the batch that it comes in");
}

TEST(sheet_views_are_a_phones_around_the_sheet)
{
    ts_rng r = ts_rng_make(6, TS_STREAM_TEST, 0);
    const double usual = (double)RD_FLASH_POWER / pow((double)RD_FLASH_DISTANCE, 2);
    for (int trial = 0; trial < 200; trial++) {
        rd_view v[5];
        double aside = 0;
        rd_sheet_draw(&r, 5, v);
        for (int i = 0; i < 5; i++) {
            double far = 0, light = 0, beside = 0, along = 0;
            for (int k = 0; k < 3; k++) {
                const double c = (double)v[i].camera[k], l = (double)v[i].light[k];
                far += c * c, light += l * l, beside += (l - c) * (l - c), along += (l - c) * c;
            }
            far = sqrt(far), light = sqrt(light), beside = sqrt(beside);
            const double tilt = acos((double)v[i].camera[2] / far) * 57.29577951308232;
            CHECK(far > 1.59 && far < 2.21 && tilt < 45.1 && (i == 0 ? tilt < 8.1 : tilt > 11.9),
                  "camera %d is %g patch widths away at %g degrees", i, far, tilt);
            CHECK(fabs(along) < 1e-5 && beside > 0.029 && beside < 0.251 && (i == 0 || fabs(beside - aside) < 1e-5),
                  "light %d is %g beside the lens, the first one %g", i, beside, aside);
            aside = beside;
            CHECK(v[i].power == v[0].power, "the flash is of different powers");
            if (i == 0)
                CHECK(fabs((double)v[0].power * (double)v[0].light[2] / pow(light, 3) / usual - 1) < 1e-5,
                      "the middle is %g times as bright as under the default flash",
                      (double)v[0].power * (double)v[0].light[2] / pow(light, 3) / usual);
        }
    }
}

/* Of the given share of materials; the others' photographs are what they are without a sheet. */
TEST(photographs_of_a_sheet_are_a_share_and_change_no_others)
{
    make();
    tr_config c = tr_config_default();
    rd_view views[COUNT][NUMBER], plain[COUNT][NUMBER];
    int under = 0;
    for (uint64_t i = 0; i < 1000; i++) under += tr_under_sheet(0.3, 1, i);
    CHECK(abs(under - 300) < 60 && !tr_under_sheet(0, 1, 7) && tr_under_sheet(1, 1, 7), "%d of 1000 for 0.3", under);
    tr_capture_views(0, 1, 7, COUNT, NUMBER, plain[0]);
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], plain[0], NUMBER, again[0][0], NULL);
    c.data.sheet = 0.6, c.data.pose = 0.01, c.data.shift = 2, c.data.bracket = 0.3;
    tr_capture_views(c.data.sheet, 1, 7, COUNT, NUMBER, views[0]);
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, many[0][0], NULL);
    under = 0;
    for (int i = 0; i < COUNT; i++) {
        const bool sheet = tr_under_sheet(c.data.sheet, 1, 7 + (uint64_t)i);
        under += sheet;
        CHECK(sheet == (memcmp(plain[i], views[i], sizeof plain[i]) != 0) &&
                  sheet == (memcmp(again[i], many[i], sizeof many[i]) != 0),
              "material %d is %sunder the sheet", i, sheet ? "" : "not ");
    }
    CHECK(under > 0 && under < COUNT, "%d of %d are under the sheet", under, COUNT);
}

/* Without faults a sheet's photographs are the renderings under the views that are given, and each key adds its own. */
TEST(photographs_of_a_sheet_have_the_faults_of_their_keys)
{
    make();
    rd_view views[COUNT][NUMBER], told[COUNT][NUMBER];
    unsigned char known[COUNT * NUMBER];
    tr_shot shots[COUNT][NUMBER];
    for (int fault = 0; fault < 4; fault++) {
        tr_config c = without_faults();
        double most = 0;
        c.data.sheet = 1;
        c.data.exposure = 1, c.data.tilt = 10, c.data.off_centre = 0.1, c.data.white_balance = 0.2; /* a sheet tells */
        if (fault == 1) c.data.pose = 0.05;
        if (fault == 2) c.data.shift = 16;
        if (fault == 3) c.data.bracket = 0.9, c.data.noise = 1, c.data.noise_spread = 0;
        tr_capture_views(1, 1, 7, COUNT, NUMBER, views[0]);
        tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, many[0][0], shots[0]);
        tr_describe_several(shots[0], COUNT * NUMBER, told[0], known);
        for (int i = 0; i < COUNT; i++)
            for (int k = 0; k < NUMBER; k++) {
                double far = 0;
                CHECK(!memcmp(told[i][k].camera, views[i][k].camera, sizeof views[i][k].camera) &&
                          !memcmp(told[i][k].light, views[i][k].light, sizeof views[i][k].light),
                      "fault %d: h is told another place than the tags say", fault);
                for (int d = 0; d < 3; d++)
                    far += pow((double)shots[i][k].is.view.camera[d] - (double)views[i][k].camera[d], 2);
                CHECK(fault == 1 ? far > 0 && far <= 0.05 * 0.05 : far == 0, "fault %d: the camera moved by %g", fault,
                      sqrt(far));
                rd_render(rd_grid_full(SIZE), maps[i], MAP_CHANNELS, &shots[i][k].is.view, true, one[0]);
                for (int p = 0; p < PIXELS * 3; p++)
                    most = farther(most, fabs((double)one[0][p] - (double)many[i][k][p]));
            }
        CHECK(fault < 2 ? most < 1e-6 : most > 1e-3, "fault %d: the photographs are %g off", fault, most);
    }
}

TEST(capture_views_are_the_flash_or_different_configurations)
{
    rd_view flash = rd_flash(), views[COUNT][NUMBER], alone[NUMBER];
    tr_capture_views(0, 1, 7, COUNT, 1, views[0]);
    CHECK(!memcmp(views[0][0].light, flash.light, sizeof flash.light) &&
              !memcmp(views[0][2].light, flash.light, sizeof flash.light),
          "one photograph is not the flash's");
    tr_capture_views(0, 1, 7, COUNT, NUMBER, views[0]);
    tr_capture_views(0, 1, 9, 1, NUMBER, alone);
    bool differ = false;
    for (int k = 0; k < NUMBER; k++) {
        CHECK(!memcmp(alone[k].light, views[2][k].light, sizeof alone[k].light),
              "a material's configurations depend on its batch");
        differ = differ || memcmp(views[0][k].light, views[1][k].light, sizeof alone[k].light);
        for (int j = 0; j < k; j++)
            CHECK(memcmp(views[0][j].light, views[0][k].light, sizeof alone[k].light),
                  "configurations %d and %d are one", j, k);
    }
    CHECK(differ, "two materials have the same configurations");
}

TEST(photographs_have_their_own_faults_for_any_number_of_threads)
{
    make();
    tr_config c = tr_config_default();
    c.data.ambient = 0.2, c.data.tone = 1, c.data.sharpen = 1, c.data.flash = 0.1;
    rd_view views[COUNT][NUMBER];
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < NUMBER; k++) views[i][k] = rd_flash();
    for (int threads = 1; threads <= 3; threads++) {
        ts_threads_set(threads);
        tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, threads == 1 ? many[0][0] : again[0][0], NULL);
        CHECK(threads == 1 || !memcmp(many, again, sizeof many), "%d threads make other bytes", threads);
    }
    ts_threads_set(0);
    for (int i = 0; i < COUNT; i++)
        for (int k = 1; k < NUMBER; k++)
            CHECK(memcmp(many[i][0], many[i][k], sizeof many[i][0]),
                  "photographs 0 and %d of material %d have the same faults", k, i);
}

TEST(photographs_are_the_renderings_of_their_shots)
{
    make();
    tr_config c = without_faults();
    c.data.fov_min = 20, c.data.fov_max = 75, c.data.flash = 0.2, c.data.tilt = 10, c.data.off_centre = 0.1;
    c.data.told_view = 0.5;
    rd_view views[COUNT][NUMBER];
    tr_shot shots[COUNT][NUMBER];
    int told = 0;
    tr_capture_views(0, 1, 7, COUNT, NUMBER, views[0]);
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, many[0][0], shots[0]);
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < NUMBER; k++) {
            rd_render(rd_grid_full(SIZE), maps[i], MAP_CHANNELS, &shots[i][k].is.view, true, one[0]);
            CHECK(!memcmp(one[0], many[i][k], sizeof one[0]), "photograph %d of material %d is another", k, i);
            told += shots[i][k].told_view;
            CHECK(shots[i][k].told_power, "a share of 1 leaves a photograph untold");
        }
    CHECK(told > 0 && told < COUNT * NUMBER, "%d of %d are told", told, COUNT * NUMBER);

    c.data.exposure = 2;
    bool differ = false;
    tr_photographs(&c, 1, 7, COUNT, SIZE, maps[0], views[0], NUMBER, many[0][0], shots[0]);
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < NUMBER; k++) {
            rd_render(rd_grid_full(SIZE), maps[i], MAP_CHANNELS, &shots[i][k].is.view, true, one[0]);
            for (int p = 0; p < PIXELS * 3; p++) {
                CHECK(fabsf(one[0][p] - many[i][k][p]) < 1e-6f, "photograph %d of material %d: %g, its shot %g", k, i,
                      many[i][k][p], one[0][p]);
            }
            differ = differ || memcmp(&shots[i][k].is.view, &shots[0][0].is.view, sizeof(rd_view));
        }
    CHECK(differ, "all photographs have one view");
}

/* A phone exposes for the sample: from any distance a flat grey shows the same value at its centre. */
TEST(photographs_are_exposed_alike_at_any_field_of_view)
{
    enum { SIDE = 25, MIDDLE = SIDE * SIDE / 2 };
    static float grey[SIDE * SIDE][MAP_CHANNELS], image[SIDE * SIDE][3];
    tr_config c = without_faults();
    for (int p = 0; p < SIDE * SIDE; p++) /* diffuse .5, flat, rough, specular 0 */
        memcpy(grey[p], (const float[MAP_CHANNELS]){0, 0, 0, 0, 0, 1, -1, -1, -1}, sizeof grey[p]);
    const rd_view flash = rd_flash();
    rd_render(rd_grid_full(SIDE), grey[0], MAP_CHANNELS, &flash, true, image[0]);
    const float usual = image[MIDDLE][1];
    double nearest = 9, farthest = 0;
    c.data.fov_min = 20, c.data.fov_max = 75;
    for (uint64_t index = 0; index < 60; index++) {
        tr_shot shot;
        tr_photographs(&c, 1, index, 1, SIDE, grey[0], NULL, 1, image[0], &shot);
        const double d = shot.is.view.camera[2], fov = 2 * atan(0.5 / d) * 57.29577951308232;
        CHECK(fabsf(image[MIDDLE][1] / usual - 1) < 0.01f, "%g at %g degrees, %g usually", image[MIDDLE][1], fov,
              usual);
        CHECK(fov > 19.99 && fov < 75.01, "field of view %g", fov);
        nearest = fmin(nearest, d), farthest = fmax(farthest, d);
    }
    CHECK(nearest < 0.75 && farthest > 2.4, "distances from %g to %g", nearest, farthest);
}

/* On a flat matt sample ambient light adds the same to every pixel, its share of what the flash gives the centre. */
TEST(photographs_have_their_share_of_ambient_light)
{
    enum { SIDE = 25, MIDDLE = SIDE * SIDE / 2 };
    static float grey[SIDE * SIDE][MAP_CHANNELS], lit[SIDE * SIDE][3], flash[SIDE * SIDE][3];
    tr_config c = without_faults();
    for (int p = 0; p < SIDE * SIDE; p++) /* diffuse .25, flat, rough, specular 0: what F gives beside it is small */
        memcpy(grey[p], (const float[MAP_CHANNELS]){-0.5f, -0.5f, -0.5f, 0, 0, 1, -1, -1, -1}, sizeof grey[p]);
    c.data.fov_min = 20, c.data.fov_max = 75, c.data.ambient = 0.4;
    for (uint64_t index = 0; index < 20; index++) {
        tr_shot shot;
        tr_photographs(&c, 1, index, 1, SIDE, grey[0], NULL, 1, lit[0], &shot);
        rd_render(rd_grid_full(SIDE), grey[0], MAP_CHANNELS, &shot.is.view, false, flash[0]);
        for (int p = 0; p < SIDE * SIDE; p++) {
            const float share = (lit[p][1] - flash[p][1]) / flash[MIDDLE][1];
            CHECK(fabsf(share - shot.is.ambient) < 0.02f * shot.is.ambient + 1e-5f, "pixel %d: %g in place of %g", p,
                  share, shot.is.ambient);
        }
    }
}

TEST(photographs_of_validation_have_the_camera_that_is_asked_for)
{
    enum { SIDE = 16, VALUES = SIDE * SIDE * 3 };
    static float usual[VALUES];
    tr_config c = tr_config_default();
    c.arch.g_width = c.arch.h_width = c.arch.h_gru = 4;
    c.validate.count = 1, c.validate.size = SIDE;
    for (int i = 0; i < 3; i++) { /* the default camera; another in [data], by which validation goes or not */
        if (i > 0) c.data.fov_min = c.data.fov_max = 25, c.data.exposure = 0;
        c.validate.camera = i == 1 ? TR_CAMERA_DEFAULT : TR_CAMERA_DATA;
        static tr_trainer t;
        ts_status st = {0};
        t = (tr_trainer){.config = c, .ranks = {.count = 1}};
        CHECK(tr_validator_create(&t, &st) == TS_OK, "%s", st.message);
        if (i == 0) memcpy(usual, t.validator.images, sizeof usual);
        CHECK((memcmp(usual, t.validator.images, sizeof usual) == 0) == (i < 2), "validation %d", i);
        CHECK(i < 2 || t.validator.shots[0].is.view.camera[2] > 2, "distance %g",
              t.validator.shots[0].is.view.camera[2]);
        tr_validator_free(&t.validator);
    }
}
