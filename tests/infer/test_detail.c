/* Detail finer than R_0's pixels, of photographs of any exposure. */
#include "infer/detail.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALL = 32, SIDE = 128, PIXELS = SIDE * SIDE, C = MAP_CHANNELS, PERIOD = 4, BURNT = 48 };
static float truth[PIXELS * C], maps[PIXELS * C], before[PIXELS * C], image[PIXELS * 3], deviation[PIXELS * MAP_GROUPS];
static float small_maps[SMALL * SMALL * C], levels[SMALL * SMALL * LGD_DETAIL_LEVELS];

/* A plain material, the part of its diffuse albedo that stripes have more or less being contrast. */
static void make(int side, float contrast, float *to)
{
    for (int i = 0; i < side * side; i++) {
        const float sign = i % side % PERIOD < PERIOD / 2 ? 1 : -1;
        for (int k = 0; k < 3; k++) {
            to[i * C + MAP_DIFFUSE + k] = 2 * (0.1f + 0.05f * (float)k) * (1 + sign * contrast) - 1;
            to[i * C + MAP_SPECULAR + k] = 2 * 0.04f - 1;
        }
        to[i * C + MAP_NORMAL] = to[i * C + MAP_NORMAL + 1] = 0;
        to[i * C + MAP_ROUGHNESS] = 0.2f;
    }
}

/* The photograph of truth, exposure times as bright, its middle burnt out; then maps from plain ones. */
static void add(float exposure, int threads)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    const rd_view view = rd_flash();
    const rd_grid grid = rd_grid_on(rd_grid_full(SIDE), threads);
    make(SIDE, 0.3f, truth);
    make(SIDE, 0, maps);
    make(SMALL, 0, small_maps);
    memcpy(before, maps, sizeof before);
    rd_render(grid, truth, C, &view, true, image);
    for (int i = 0; i < PIXELS; i++) {
        const bool middle = abs(i / SIDE - SIDE / 2) < BURNT / 2 && abs(i % SIDE - SIDE / 2) < BURNT / 2;
        for (int k = 0; k < 3; k++) image[3 * i + k] = middle ? 1 : image[3 * i + k] * exposure;
        for (int k = 0; k < MAP_GROUPS; k++) deviation[i * MAP_GROUPS + k] = k == GROUP_DIFFUSE ? 0.2f : 0.1f;
    }
    const ts_tensor photo = ts_view(image, (ts_shape){1, SIDE, SIDE, 3});
    const ts_taps taps = ts_taps_smooth(arena, SMALL, SIDE);
    CHECK(!lgd_detail_compare(rd_grid_on(rd_grid_full(SMALL), threads), small_maps, C, &view, &photo, arena, levels,
                              &st) &&
              !lgd_detail_add(grid, &taps, &taps, levels, image, &view, deviation, C, arena, maps, &st),
          "%s", st.message);
    ts_arena_destroy(&arena);
}

/* Stripes are found whatever the exposure, and the level stays R_0's. */
TEST(detail_is_found_at_any_exposure)
{
    for (int e = 0; e < 3; e++) {
        const float exposure = (const float[]){0.5f, 1, 1.4f}[e];
        double light = 0, dark = 0, true_light = 0, true_dark = 0, leans = 0;
        int count = 0;
        add(exposure, 2);
        for (int y = 4; y < SIDE / 2 - BURNT; y++)
            for (int x = 4; x < SIDE - 4; x++, count++) {
                const int i = (y * SIDE + x) * C;
                const double own = ((double)maps[i] + 1) / 2, want = ((double)truth[i] + 1) / 2;
                *(x % PERIOD < PERIOD / 2 ? &light : &dark) += own;
                *(x % PERIOD < PERIOD / 2 ? &true_light : &true_dark) += want;
                leans += (double)maps[i + MAP_NORMAL] * (double)maps[i + MAP_NORMAL];
            }
        CHECK(light - dark > 0.7 * (true_light - true_dark) && light - dark < 1.05 * (true_light - true_dark),
              "exposure %g: stripes of %g, in truth %g", (double)exposure, (light - dark) / count,
              (true_light - true_dark) / count);
        CHECK(fabs((light + dark) / (true_light + true_dark) - 1) < 0.03, "exposure %g: the level is off by %g",
              (double)exposure, (light + dark) / (true_light + true_dark) - 1);
        CHECK(sqrt(leans / count) < 0.05, "normals lean by %g", sqrt(leans / count));
    }
}

/* Where the photograph is burnt out maps stay, and there is no rim of what is not known beside it. */
TEST(detail_stays_away_from_burnt_out_pixels)
{
    add(1, 2);
    double most = 0, rim = 0, beyond = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const int far = (int)fmax(abs(y - SIDE / 2), abs(x - SIDE / 2));
            for (int k = 0; k < C; k++) {
                const int i = (y * SIDE + x) * C + k;
                const double change = fabs((double)(maps[i] - before[i]));
                beyond = farther(beyond, fabs((double)maps[i]) - 1);
                if (far < BURNT / 2) most = fmax(most, change);
                else if (far < BURNT / 2 + 8 && k < MAP_NORMAL)
                    rim = fmax(rim, change - fabs((double)(truth[i] - before[i])));
            }
        }
    CHECK(beyond < 1e-6, "a map's value is %g beyond its range", beyond);
    CHECK(most < 1e-3, "burnt-out pixels changed by %g", most);
    CHECK(rim < 0.02, "beside them diffuse changed by %g more than the material does", rim);
}

TEST(detail_has_the_same_bytes_for_any_number_of_threads)
{
    static float one[PIXELS * C];
    add(0.7f, 1);
    memcpy(one, maps, sizeof one);
    add(0.7f, 3);
    CHECK(memcmp(one, maps, sizeof one) == 0, "other bytes with three threads");
}
