/* The steps of Gauss and Newton's method, of every instruction set, against the same equations in double. */
#include "tensor/cpu.h"
#include "tests/support/normal_equations.h"
#include "tests/support/shading.h"
#include <math.h>
#include <string.h>

enum { SIDE = 19, PIXELS = SIDE * SIDE, MOST = RD_CAPTURE_VIEWS };

static void plain_maps(ts_rng *rng, float *maps)
{
    for (int i = 0; i < PIXELS * C; i++) maps[i] = ts_rng_range(rng, -0.8f, 0.8f);
    for (int p = 0; p < PIXELS; p++) {
        maps[p * C + MAP_ROUGHNESS] = ts_rng_range(rng, -0.5f, 1);
        for (int k = 0; k < 2; k++) maps[p * C + MAP_NORMAL + k] = ts_rng_range(rng, -0.5f, 0.5f);
    }
}

static void take_photographs(rd_grid grid, const float *truth, const rd_view *views, int count, float **image)
{
    for (int k = 0; k < count; k++) {
        image[k] = floats(PIXELS * 3);
        rd_render(grid, truth, C, &views[k], true, image[k]);
    }
}

TEST(newton_solves_the_equations)
{
    float *truth = floats(PIXELS * C), *maps = floats(PIXELS * C), *step = floats(PIXELS * C), *image[MOST], damping[C];
    const rd_grid grid = rd_grid_full(SIDE);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        double worst = 0;
        for (int count = 1; count <= MOST; count += 2) {
            ts_rng rng = ts_rng_make(8, TS_STREAM_TEST, (uint64_t)count);
            rd_view views[MOST];
            rd_capture_draw(&rng, count, views);
            plain_maps(&rng, truth), plain_maps(&rng, maps);
            take_photographs(grid, truth, views, count, image);
            for (int i = 0; i < C; i++) damping[i] = 1;
            rd_newton_step(grid, maps, C, views, (const float *const *)image, count, damping, step);
            for (int p = 0; p < PIXELS; p++) {
                double point[2], a[C][C], b[C], x[C];
                rd_centre(grid, p % SIDE, p / SIDE, point);
                normal_equations(maps + p * C, point, views, (const float *const *)image, p, count, damping, a, b);
                normal_solve(a, b, x);
                for (int i = 0; i < C; i++) {
                    const double at = (double)maps[p * C + i], expected = fmin(fmax(at + x[i], -1), 1) - at,
                                 error = fabs((double)step[p * C + i] - expected);
                    worst = fmax(worst, error);
                    CHECK(error <= 1e-5, "%s, %d photographs: channel %d goes by %g, not %g", ts_isa_name((ts_isa)isa),
                          count, i, (double)step[p * C + i], expected);
                }
            }
            for (int k = 0; k < count; k++) free(image[k]);
        }
        printf("%s: off by %.2g at most\n", ts_isa_name((ts_isa)isa), worst);
    }
    free(truth), free(maps), free(step);
}

/* Maps outside [-1, 1], at its ends and a rounding beyond lead where those that are cut lead: rounding decides nothing.
 */
TEST(newton_starts_inside)
{
    float *truth = floats(PIXELS * C), *maps = floats(PIXELS * C), *cut = floats(PIXELS * C), *image[MOST], damping[C];
    float *step = floats(PIXELS * C), *inside = floats(PIXELS * C);
    const rd_grid grid = rd_grid_full(SIDE);
    for (int i = 0; i < C; i++) damping[i] = 0.1f;
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int count = 1; count <= MOST; count += 4) {
            ts_rng rng = ts_rng_make(12, TS_STREAM_TEST, (uint64_t)count);
            rd_view views[MOST];
            rd_capture_draw(&rng, count, views);
            plain_maps(&rng, truth), plain_maps(&rng, maps);
            take_photographs(grid, truth, views, count, image);
            push_out(&rng, PIXELS, maps, cut);
            rd_newton_step(grid, maps, C, views, (const float *const *)image, count, damping, step);
            rd_newton_step(grid, cut, C, views, (const float *const *)image, count, damping, inside);
            for (int i = 0; i < PIXELS * C; i++)
                CHECK(fabsf((maps[i] + step[i]) - (cut[i] + inside[i])) <= 1e-6f,
                      "%s, %d photographs: channel %d of pixel %d goes from %.9g to %g, from %g to %g",
                      ts_isa_name((ts_isa)isa), count, i % C, i / C, (double)maps[i], (double)(maps[i] + step[i]),
                      (double)cut[i], (double)(cut[i] + inside[i]));
            for (int k = 0; k < count; k++) free(image[k]);
        }
    }
    free(truth), free(maps), free(cut), free(step), free(inside);
}

TEST(newton_rests_at_the_truth)
{
    float *truth = floats(PIXELS * C), *step = floats(PIXELS * C), *image[MOST], damping[C];
    const rd_grid grid = rd_grid_full(SIDE);
    ts_rng rng = ts_rng_make(9, TS_STREAM_TEST, 0);
    rd_view views[MOST];
    rd_capture_draw(&rng, 5, views);
    plain_maps(&rng, truth);
    take_photographs(grid, truth, views, 5, image);
    for (int i = 0; i < C; i++) damping[i] = 0.1f;
    rd_newton_step(grid, truth, C, views, (const float *const *)image, 5, damping, step);
    for (int i = 0; i < PIXELS * C; i++)
        CHECK(fabs((double)step[i]) <= 1e-6, "a step of %g at the truth", (double)step[i]);
    for (int k = 0; k < 5; k++) free(image[k]);
    free(truth), free(step);
}

/* Nine photographs determine nine numbers: from maps near the truth the method finds back to it, in a handful of steps,
 * quadratically but for the damping. */
TEST(newton_finds_the_truth)
{
    float *truth = floats(PIXELS * C), *maps = floats(PIXELS * C), *step = floats(PIXELS * C), *image[MOST], damping[C];
    const rd_grid grid = rd_grid_full(SIDE);
    ts_rng rng = ts_rng_make(10, TS_STREAM_TEST, 0);
    rd_view views[MOST];
    for (int k = 0; k < MOST; k++) views[k] = rd_capture_view(k);
    plain_maps(&rng, truth);
    take_photographs(grid, truth, views, MOST, image);
    for (int i = 0; i < PIXELS * C; i++) maps[i] = truth[i] + ts_rng_range(&rng, -0.05f, 0.05f);
    for (int i = 0; i < C; i++) damping[i] = 1e-3f;
    double before = 0, after = 0, rmse;
    for (int k = 0; k < MOST; k++) rd_flash_rmse(grid, maps, C, &views[k], image[k], &rmse), before += rmse;
    for (int t = 0; t < 8; t++) {
        rd_newton_step(grid, maps, C, views, (const float *const *)image, MOST, damping, step);
        for (int i = 0; i < PIXELS * C; i++) maps[i] += step[i];
    }
    for (int k = 0; k < MOST; k++) rd_flash_rmse(grid, maps, C, &views[k], image[k], &rmse), after += rmse;
    printf("RMSE of the photographs %.2g before, %.2g after\n", before / MOST, after / MOST);
    CHECK(after < 0.01 * before, "%g before, %g after", before / MOST, after / MOST);
    for (int k = 0; k < MOST; k++) free(image[k]);
    free(truth), free(maps), free(step);
}

/* A highlight far above 1 comes back to a photograph that is not burnt out, and stays where it is. */
TEST(newton_leaves_the_clamp)
{
    float *truth = floats(PIXELS * C), *maps = floats(PIXELS * C), *step = floats(PIXELS * C),
          *image = floats(PIXELS * 3), damping[C];
    const rd_grid grid = rd_grid_full(SIDE);
    const rd_view flash = rd_flash();
    for (int p = 0; p < PIXELS; p++)
        for (int i = 0; i < C; i++) {
            truth[p * C + i] = i == MAP_ROUGHNESS ? 0.3f : i == MAP_NORMAL || i == MAP_NORMAL + 1 ? 0 : -0.6f;
            maps[p * C + i] = i == MAP_ROUGHNESS ? -0.5f : truth[p * C + i];
        }
    for (int i = 0; i < C; i++) damping[i] = 0.1f;
    rd_render(grid, truth, C, &flash, true, image);
    const int centre = SIDE / 2 * SIDE + SIDE / 2;
    float bright[3 * PIXELS];
    rd_render(grid, maps, C, &flash, false, bright);
    CHECK(image[centre * 3] < TS_NEWTON_BURNT && bright[centre * 3] > 4,
          "%g in the photograph, %g rendered: no such case", (double)image[centre * 3], (double)bright[centre * 3]);
    const rd_view *views = &flash;
    const float *photographs = image;
    for (int t = 0; t < 12; t++) {
        rd_newton_step(grid, maps, C, views, &photographs, 1, damping, step);
        for (int i = 0; i < PIXELS * C; i++) maps[i] += step[i];
    }
    rd_render(grid, maps, C, &flash, false, bright);
    for (int i = 0; i < 3; i++)
        CHECK(fabsf(bright[centre * 3 + i] - image[centre * 3 + i]) < 1e-3f, "%g, not %g",
              (double)bright[centre * 3 + i], (double)image[centre * 3 + i]);
    for (int p = 0; p < PIXELS; p++) maps[p * C + MAP_ROUGHNESS] = -0.5f;
    for (int i = 0; i < 3; i++) image[centre * 3 + i] = TS_NEWTON_BURNT + 0.01f;
    rd_newton_step(grid, maps, C, views, &photographs, 1, damping, step);
    for (int i = 0; i < C; i++)
        CHECK(step[centre * C + i] == 0, "channel %d moves by %g where the photograph is burnt out", i,
              (double)step[centre * C + i]);
    free(truth), free(maps), free(step), free(image);
}

TEST(newton_is_finite_everywhere)
{
    static const float extreme[] = {-1,     1, 0,  -0.999999f, 0.999999f, -1.0000001f, 1.0000001f, 0.98f,
                                    -0.98f, 2, -5, 1e30f,      -1e30f,    1e-30f,      1e-40f};
    static const float places[] = {0, 0, 0.5f, -0.5f, 1e-20f, 1e-6f, -1e-6f, 0.001f, 1, 3, 1e4f, 1e30f, -1e30f, 1e-40f};
    static const float dampings[] = {1e-6f, 1e-3f, 1, 1e6f};
    enum { EXTREMES = sizeof extreme / sizeof *extreme, PLACES = sizeof places / sizeof *places, W = 37, CH = 10 };
    float *maps = floats(W * CH), *step = floats(W * CH), *image[MOST];
    for (int k = 0; k < MOST; k++) image[k] = floats(W * 3);
    const rd_grid grid = {.h = 1, .w = W, .y0 = 18, .x0 = 0, .side = W}; /* the middle row: a pixel lies at (0, 0) */
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        ts_rng rng = ts_rng_make(11, TS_STREAM_TEST, 0);
        bool moved = false;
        for (int round = 0; round < 1500; round++) {
            const int count = 1 + round % MOST;
            float damping[C];
            rd_view views[MOST];
            for (int i = 0; i < C; i++) damping[i] = dampings[ts_rng_int(&rng, 4)];
            for (int i = 0; i < W * CH; i++)
                maps[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
            for (int k = 0; k < count; k++) {
                views[k] = (rd_view){.kind = RD_POINT, .power = RD_FLASH_POWER};
                for (int j = 0; j < 3; j++) {
                    views[k].light[j] = places[ts_rng_int(&rng, PLACES)];
                    views[k].camera[j] = ts_rng_int(&rng, 3) ? places[ts_rng_int(&rng, PLACES)] : views[k].light[j];
                }
                for (int i = 0; i < W * 3; i++)
                    image[k][i] = ts_rng_int(&rng, 3) ? ts_rng_range(&rng, 0, 1) : (float)ts_rng_int(&rng, 2);
            }
            memset(step, 0, W * CH * sizeof *step);
            rd_newton_step(grid, maps, CH, views, (const float *const *)image, count, damping, step);
            for (int p = 0; p < W; p++)
                for (int i = 0; i < C; i++) {
                    const float now = maps[p * CH + i], to = now + step[p * CH + i];
                    CHECK(isfinite(step[p * CH + i]), "%s, round %d: channel %d of pixel %d goes by %g",
                          ts_isa_name((ts_isa)isa), round, i, p, (double)step[p * CH + i]);
                    CHECK(to >= -1.0001f && to <= 1.0001f, "round %d: a step leads to %g", round, (double)to);
                    moved |= fabsf(now) <= 1 && step[p * CH + i] != 0;
                }
            for (int p = 0; p < W; p++) CHECK(step[p * CH + 9] == 0, "the tenth channel was written");
        }
        CHECK(moved, "nothing moved");
    }
    for (int k = 0; k < MOST; k++) free(image[k]);
    free(maps), free(step);
}
