/* Refinement in tiles: the untiled result, less work, less memory. */
#include "infer/tiles.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LARGE = 75, TILES_T = 4 };

static void make_image(float *image, int side)
{
    ts_rng rng = ts_rng_make(11, TS_STREAM_TEST, (uint64_t)side);
    for (int i = 0; i < side * side * 3; i++) image[i] = 0.2f + 0.6f * ts_rng_uniform(&rng);
}

static nn_model *random_model_of(int h_width, bool recurrent, int images, int coarse_steps)
{
    nn_arch a = nn_arch_default();
    a.images = images;
    a.g_width = 4;
    a.g_width_max = 8;
    a.g_levels = 2;
    a.g_size = 16;
    a.h_width = h_width;
    a.h_gru = 4;
    a.coarse_steps = coarse_steps, a.coarse_size = 20, a.coarse_width = 6, a.coarse_gru = 3;
    ts_status st = {0};
    a.recurrent = recurrent;
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 7);
    size_t first, last, unused;
    nn_model_range(m, NN_H, &first, &unused);
    nn_model_range(m, NN_COARSE, &unused, &last); /* they follow each other */
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (size_t i = first; i < last; i++) m->value[i] += ts_rng_range(&rng, -0.05f, 0.05f);
    return m;
}

static nn_model *random_model(bool recurrent) { return random_model_of(8, recurrent, 1, 0); }

/* One flash photograph in tiles. */
static lgd_tiles flash_tiles(const float *const *image, int side, int tile, int steps)
{
    static rd_view flash;
    flash = rd_flash();
    return (lgd_tiles){.image = image, .views = &flash, .given = 1, .side = side, .tile = tile, .steps = steps};
}

static ag_tape *frozen_tape(void)
{
    ts_status st = {0};
    ag_tape *tape = ag_tape_create(false, &st);
    CHECK(tape, "%s", st.message);
    ag_freeze(tape, true);
    return tape;
}

/* R_0 ... R_T of the whole in one piece. */
static void untiled(ag_tape *tape, const nn_model *m, float *image, int side, float *maps[TILES_T + 1])
{
    nn_input in = {
        .image = ts_view(image, (ts_shape){1, side, side, 3}), .grid = rd_grid_full(side), .view = rd_flash()};
    ag_value *out[TILES_T + 1];
    ag_reset(tape);
    CHECK(nn_lgd(tape, m, &in, TILES_T, true, out, NULL) == TS_OK, "%s", ag_status(tape)->message);
    for (int t = 0; t <= TILES_T; t++)
        memcpy(maps[t], out[t]->t.data, (size_t)ts_count(out[t]->t.shape) * sizeof(float));
}

static double farthest(const float *a, const float *b, size_t values)
{
    double most = 0;
    for (size_t i = 0; i < values; i++) most = farther(most, fabs((double)a[i] - b[i]));
    return most;
}

static float whole_maps[TILES_T + 1][LARGE * LARGE * MAP_CHANNELS], tiled_maps[LARGE * LARGE * MAP_CHANNELS],
    large[LARGE * LARGE * 3];
static const float *const only[] = {large};

/* Every step of every tile size on odd sizes: the untiled result to rounding, so there are no seams. */
TEST(infer_tiles_give_the_untiled_result)
{
    ag_tape *tape = frozen_tape();
    for (int variant = 0; variant < 6; variant++) { /* h without states, with them, none but the Newton step; the first
                                                       two or all steps at g's size */
        const int coarse = variant < 3 ? 0 : variant < 5 ? 2 : TILES_T;
        const bool network = variant % 3 < 2;
        nn_model *m = random_model_of(network ? 8 : 0, variant % 3 == 1, 1, coarse);
        CHECK(nn_refiner_reach(m) == (network ? 5 : 0), "h reaches %d pixels", nn_refiner_reach(m));
        static const int sides[] = {LARGE, 33, 7, 1}, tiles[] = {1000, 32, 17, 9};
        for (size_t s = 0; s < sizeof sides / sizeof *sides; s++) {
            const int side = sides[s];
            const size_t values = (size_t)side * (size_t)side * MAP_CHANNELS;
            float *maps[TILES_T + 1];
            for (int t = 0; t <= TILES_T; t++) maps[t] = whole_maps[t];
            make_image(large, side);
            untiled(tape, m, large, side, maps);
            const bool saturated = !network && side == 1; /* its one pixel has no gradient */
            CHECK(saturated || farthest(maps[TILES_T], maps[TILES_T - 1], values) > (network ? 1e-3 : 0),
                  "a step changes nothing"); /* Newton's come to rest */
            for (size_t k = 0; k < sizeof tiles / sizeof *tiles; k++) {
                double rmse[TILES_T + 1];
                ts_status st = {0};
                lgd_tiles t = flash_tiles(only, side, tiles[k], TILES_T);
                t.rmse = rmse;
                CHECK(lgd_tiles_run(tape, m, &t, tiled_maps, &st) == TS_OK, "%s", st.message);
                const double far = farthest(tiled_maps, maps[TILES_T], values);
                CHECK(far < 2e-5, "side %d, tiles of %d: %g away", side, tiles[k], far);
                for (int i = 0; i <= TILES_T; i++) {
                    double want;
                    const rd_view view = rd_flash();
                    rd_flash_rmse(rd_grid_full(side), maps[i], MAP_CHANNELS, &view, large, &want);
                    CHECK(fabs(rmse[i] - want) < 1e-5, "side %d, tiles of %d: RMSE %g at step %d, not %g", side,
                          tiles[k], rmse[i], i, want);
                }
                CHECK(t.refined == (int64_t)side * side * (TILES_T - coarse), "%lld pixels are refined",
                      (long long)t.refined);
            }
        }
        nn_model_free(&m);
    }
    ag_tape_destroy(&tape);
}

/* The same of several photographs, fewer than the model could read. */
TEST(infer_tiles_of_several_photographs)
{
    enum { GIVEN = 2 };
    static float images[GIVEN][LARGE * LARGE * 3];
    ag_tape *tape = frozen_tape();
    nn_model *m = random_model_of(8, true, 3, 1);
    rd_view views[GIVEN];
    make_image(images[0], LARGE);
    make_image(images[1], LARGE - 1);
    for (int k = 0; k < GIVEN; k++) views[k] = rd_capture_view(2 + k);
    const nn_input in = {.image = ts_view(images[0], (ts_shape){GIVEN, LARGE, LARGE, 3}),
                         .grid = rd_grid_full(LARGE),
                         .views = views,
                         .given = GIVEN};
    ag_value *out;
    ag_reset(tape);
    CHECK(nn_lgd(tape, m, &in, TILES_T, false, &out, NULL) == TS_OK, "%s", ag_status(tape)->message);
    const size_t values = LARGE * LARGE * MAP_CHANNELS;
    memcpy(whole_maps[0], out->t.data, values * sizeof(float));
    ts_status st = {0};
    lgd_tiles t = {.image = (const float *const[]){images[0], images[1]},
                   .views = views,
                   .given = GIVEN,
                   .side = LARGE,
                   .tile = 30,
                   .steps = TILES_T};
    CHECK(lgd_tiles_run(tape, m, &t, tiled_maps, &st) == TS_OK, "%s", st.message);
    const double far = farthest(tiled_maps, whole_maps[0], values);
    CHECK(far < 2e-5, "%g away", far);
    nn_model_free(&m);
    ag_tape_destroy(&tape);
}

/* Where the mask wants them the maps are those without it, and most of the work is not done. */
TEST(infer_mask_changes_nothing_where_it_is_set)
{
    static unsigned char mask[LARGE * LARGE];
    ag_tape *tape = frozen_tape();
    nn_model *m = random_model(true);
    float *maps[TILES_T + 1];
    for (int t = 0; t <= TILES_T; t++) maps[t] = whole_maps[t];
    make_image(large, LARGE);
    untiled(tape, m, large, LARGE, maps);
    for (int y = 20; y < 37; y++)
        for (int x = 50; x < LARGE; x++) mask[y * LARGE + x] = (x + y) % 3 == 0;
    mask[LARGE * LARGE - 1] = 255;
    ts_status st = {0};
    lgd_tiles t = flash_tiles(only, LARGE, 16, TILES_T);
    t.mask = mask;
    CHECK(lgd_tiles_run(tape, m, &t, tiled_maps, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < LARGE * LARGE; i++) {
        const size_t at = (size_t)i * MAP_CHANNELS;
        const double refined = farthest(tiled_maps + at, maps[TILES_T] + at, MAP_CHANNELS),
                     first = farthest(tiled_maps + at, maps[0] + at, MAP_CHANNELS);
        CHECK(refined < 2e-5 || (!mask[i] && first < 2e-5),
              "pixel %d is %g from the refined and %g from the first maps", i, refined, first);
    }
    CHECK(t.refined > 0 && t.refined < (int64_t)LARGE * LARGE * TILES_T / 8, "%lld pixels are refined",
          (long long)t.refined);
    memset(mask, 0, sizeof mask);
    CHECK(lgd_tiles_run(tape, m, &t, tiled_maps, &st) == TS_OK && t.refined == 0, "an empty mask refines %lld pixels",
          (long long)t.refined);
    CHECK(farthest(tiled_maps, maps[0], sizeof tiled_maps / sizeof(float)) < 2e-5, "an empty mask does not give R_0");
    nn_model_free(&m);
    ag_tape_destroy(&tape);
}

/* A tile that ends early has exactly the maps of the step at which it did, and that step's change was below the
 * tolerance. */
TEST(infer_tolerance_ends_a_tile_at_one_of_its_steps)
{
    enum { TILE = 25 };
    ag_tape *tape = frozen_tape();
    nn_model *m = random_model(true);
    float *maps[TILES_T + 1];
    for (int t = 0; t <= TILES_T; t++) maps[t] = whole_maps[t];
    make_image(large, LARGE);
    untiled(tape, m, large, LARGE, maps);
    int64_t before = (int64_t)LARGE * LARGE * TILES_T + 1;
    const double change = farthest(maps[1], maps[0], sizeof tiled_maps / sizeof(float));
    for (double tolerance = 1e-6; tolerance < 2 * change; tolerance *= 4) {
        ts_status st = {0};
        lgd_tiles t = flash_tiles(only, LARGE, TILE, TILES_T);
        t.tolerance = tolerance;
        CHECK(lgd_tiles_run(tape, m, &t, tiled_maps, &st) == TS_OK, "%s", st.message);
        CHECK(t.refined <= before, "more work with a larger tolerance");
        before = t.refined;
        for (int tile = 0; tile < 9; tile++) {
            double best = 1;
            for (int step = 1; step <= TILES_T; step++) {
                double far = 0;
                for (int y = 0; y < TILE; y++) {
                    const size_t at = ((size_t)(tile / 3 * TILE + y) * LARGE + (size_t)(tile % 3 * TILE)) *
                        MAP_CHANNELS;
                    far = fmax(far, farthest(tiled_maps + at, maps[step] + at, TILE * MAP_CHANNELS));
                }
                best = fmin(best, far);
            }
            CHECK(best < 2e-5, "tolerance %g: tile %d is %g away from every step", tolerance, tile, best);
        }
    }
    CHECK(before == (int64_t)LARGE * LARGE, "%lld pixels are refined with a tolerance above every change",
          (long long)before);
    nn_model_free(&m);
    ag_tape_destroy(&tape);
}

/* The memory of a tile does not grow with the photograph: beyond it there are a band of maps and the photograph itself.
 */
TEST(infer_tiles_need_no_memory_for_the_whole)
{
    nn_model *m = random_model(true);
    size_t peak[2];
    for (int k = 0; k < 2; k++) {
        const int side = k ? 768 : 256;
        const size_t pixels = (size_t)side * (size_t)side;
        float *image = malloc(pixels * 3 * sizeof *image), *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
        CHECK(image && maps, "out of memory");
        for (size_t i = 0; i < pixels * 3; i++) image[i] = 0.5f;
        ag_tape *tape = frozen_tape();
        ts_status st = {0};
        lgd_tiles t = flash_tiles((const float *const[]){image}, side, 64, 1);
        CHECK(lgd_tiles_run(tape, m, &t, maps, &st) == TS_OK, "%s", st.message);
        peak[k] = ts_arena_peak(ag_arena(tape));
        ag_tape_destroy(&tape);
        free(image);
        free(maps);
    }
    const size_t photographs = (768 * 768 - 256 * 256) * 3 * sizeof(float),
                 bands = 64 * (768 - 256) * (2 * MAP_CHANNELS + 3) * sizeof(float);
    CHECK(peak[1] <= peak[0] + photographs + bands + (1 << 20), "%zu bytes at 768 and %zu at 256", peak[1], peak[0]);
    nn_model_free(&m);
}
