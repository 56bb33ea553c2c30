/* A photograph as a function of its scene, of every instruction set. */
#include "render/ambient.h"
#include "render/kernels/newton.h"
#include "render/rows.h"
#include "render/scene_model.h"
#include "tensor/cpu.h"
#include "tests/support/normal_equations.h"
#include "tests/support/scene_maps.h"
#include <math.h>
#include <string.h>

enum { SIDE = 48, PIXELS = SIDE * SIDE, K = RD_SCENE_UNKNOWNS, G = MAP_GROUPS };

static void random_numbers(ts_rng *rng, float number[K])
{
    for (int i = 0; i < K; i++) number[i] = ts_rng_range(rng, -0.5f, 0.5f);
    number[RD_SCENE_AMBIENT] = fabsf(number[RD_SCENE_AMBIENT]);
    number[RD_SCENE_ROUGHNESS] = 0;
}

TEST(scene_photograph_equals_its_double_twin)
{
    float *maps = floats(PIXELS * C), *image = floats(PIXELS * 3), *other = floats(PIXELS * 3);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int round = 0; round < 6; round++) {
            ts_rng rng = ts_rng_make(50, TS_STREAM_TEST, (uint64_t)round);
            float number[K];
            double numbers[K];
            scene_maps(&rng, PIXELS, maps), random_numbers(&rng, number);
            if (round % 2) number[RD_SCENE_TONE] = 0;
            for (int i = 0; i < K; i++) numbers[i] = (double)number[i];
            const rd_view view = rd_scene_view(number);
            rd_scene_photograph(rd_grid_full(SIDE), maps, C, number, false, image);
            rd_render(rd_grid_full(SIDE), maps, C, &view, false, other);
            for (int p = 0; p < PIXELS; p++) {
                double m[C], point[2], value[3];
                to_double(maps + p * C, m);
                rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
                rd_scene_value(m, point, numbers, value);
                for (int c = 0; c < 3; c++) {
                    CHECK(fabs((double)image[p * 3 + c] - value[c]) <= 2e-5 * (1e-3 + value[c]), "%s: %g, not %g",
                          ts_isa_name((ts_isa)isa), (double)image[p * 3 + c], value[c]);
                    CHECK(round % 2 == 0 || fabs((double)other[p * 3 + c] - value[c]) <= 1e-4 * (1e-3 + value[c]),
                          "as a view %g, not %g", (double)other[p * 3 + c], value[c]);
                }
            }
        }
    }
    free(maps), free(image), free(other);
}

/* seen of a pixel's maps, a scene's numbers and the roughness' level, as in render/posterior.h. */
static void seen_of(const double maps[C], const double point[2], const double number[K], double seen[3])
{
    double at[C];
    memcpy(at, maps, sizeof at);
    at[MAP_ROUGHNESS] = fmin((at[MAP_ROUGHNESS] + 1) * exp(number[RD_SCENE_ROUGHNESS]) - 1, 1);
    rd_scene_value(at, point, number, seen);
    for (int c = 0; c < 3; c++)
        if (seen[c] > 1) seen[c] = 1 + log(seen[c]);
}

/* Central differences of seen by value i of x, one of the two vectors. */
static void differences(const double maps[C], const double point[2], const double number[K], double *x, int i,
                        double by[3])
{
    const double step = 1e-5, at = x[i];
    double high[3], low[3];
    x[i] = at + step, seen_of(maps, point, number, high);
    x[i] = at - step, seen_of(maps, point, number, low);
    x[i] = at;
    for (int c = 0; c < 3; c++) by[c] = (high[c] - low[c]) / (2 * step);
}

/* Inverse of a symmetric positive 3 x 3 matrix. */
static void invert(double a[3][3], double out[3][3])
{
    double det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            out[j][i] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
            if (i == 0) det += a[0][j] * out[j][0];
        }
    for (int i = 0; i < 9; i++) out[i / 3][i % 3] /= det;
}

/* The normal equations in double with numerical derivatives. */
static void add_pixel(const float *maps, const double point[2], const float *image, const float *deviation,
                      const float *number, const ts_prior *prior, bool least, double matrix[K][K], double right[K])
{
    double m[C], numbers[K], d[G], sigma[C][C], by_maps[C][3], by[K][3], s[3][3] = {{0}}, v[3][3], seen[3], value[3];
    to_double(maps, m);
    for (int i = 0; i < K; i++) numbers[i] = (double)number[i];
    for (int g = 0; g < G; g++) d[g] = (double)deviation[g];
    rd_prior_covariance(d, m, prior, sigma);
    seen_of(m, point, numbers, seen), rd_scene_value(m, point, numbers, value);
    for (int i = 0; i < C; i++) differences(m, point, numbers, m, i, by_maps[i]);
    for (int i = 0; i < K; i++) differences(m, point, numbers, numbers, i, by[i]);
    for (int c = 0; c < 3; c++)
        if ((value[c] > 1 || !least) && image[c] >= TS_NEWTON_BURNT) {
            for (int i = 0; i < C; i++) by_maps[i][c] = 0;
            for (int i = 0; i < K; i++) by[i][c] = 0;
        }
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            if (a == b)
                s[a][b] = pow((double)prior->model, 2) + (double)prior->noise * fmin(value[a], 1) +
                    pow((double)prior->gain * fmin(value[a], 1), 2);
            for (int i = 0; i < C; i++)
                for (int j = 0; j < C; j++) s[a][b] += by_maps[i][a] * sigma[i][j] * by_maps[j][b];
        }
    invert(s, v);
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int i = 0; i < K; i++) {
                right[i] += by[i][a] * v[a][b] * ((double)image[b] - seen[b]);
                for (int j = 0; j < K; j++) matrix[i][j] += by[i][a] * v[a][b] * by[j][b];
            }
}

TEST(scene_normal_equations_equal_their_double_twin)
{
    enum { W = 13 };
    const rd_grid grid = rd_grid_full(W);
    float *maps = floats(PIXELS * C), *image = floats(W * W * 3), *deviation = floats(W * W * G);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        double worst = 0;
        for (int round = 0; round < 6; round++) {
            ts_rng rng = ts_rng_make(51, TS_STREAM_TEST, (uint64_t)round);
            const ts_prior prior = {
                {0.1f, round % 2 ? 1 : 0}, 0.05f, 0.02f, round % 3 ? 0.3f : 0, round % 2 ? 0.5f : 0};
            float number[K], truth[K];
            double matrix[K][K] = {{0}}, right[K] = {0}, size[K];
            scene_maps(&rng, PIXELS, maps), random_numbers(&rng, number), random_numbers(&rng, truth);
            for (int i = 0; i < W * W * G; i++) deviation[i] = ts_rng_range(&rng, 0, 0.3f);
            rd_scene_photograph(grid, maps, C, truth, true, image);
            ts_scene scene = rd_scene_of(number);
            scene.least = round % 3 != 0;
            ts_scene_sums sums = {.right = {0}};
            for (int y = 0; y < W; y++) {
                const ts_shade_row row = rd_shade_row(grid, y, maps, C);
                ts_scene_k()->normal(&scene, &row, image + y * W * 3, &prior, deviation + y * W * G, &sums);
            }
            for (int p = 0; p < W * W; p++) {
                double point[2];
                rd_centre(grid, p % W, p / W, point);
                add_pixel(maps + p * C, point, image + p * 3, deviation + p * G, number, &prior, scene.least, matrix,
                          right);
            }
            for (int i = 0; i < K; i++) size[i] = sqrt(matrix[i][i]);
            for (int i = 0, at = 0; i < K; i++) {
                worst = farther(worst, fabs(sums.right[i] - right[i]) / (size[i] * W));
                for (int j = i; j < K; j++, at++)
                    worst = farther(worst, fabs(sums.matrix[at] - matrix[i][j]) / (size[i] * size[j]));
            }
            CHECK(worst < 1e-4, "%s, round %d: off by %g", ts_isa_name((ts_isa)isa), round, worst);
        }
        printf("%s: off by %.2g at most\n", ts_isa_name((ts_isa)isa), worst);
    }
    free(maps), free(image), free(deviation);
}

/* A share of the ambient light comes back from its number as the radiance that rd_ambient_add gives it, wherever the
 * light is. */
TEST(scene_ambient_light_has_one_unit)
{
    float number[RD_SCENE_NUMBERS], image[3] = {0}, maps[MAP_CHANNELS] = {0};
    const rd_ambient ambient = {.uniform = {0.2f, 0.2f, 0.2f}, .direction = {0, 0, 1}};
    for (int side = 0; side < 3; side++) {
        rd_view view = rd_flash();
        view.light[0] = 0.3f * (float)side;
        for (int k = 0; k < 3; k++) image[k] = 0, maps[MAP_DIFFUSE + k] = 1, maps[MAP_SPECULAR + k] = -1;
        rd_ambient_add(rd_grid_full(1), maps, MAP_CHANNELS, &view, &ambient, image);
        rd_scene_numbers(&view, 0.2f, 0, number);
        const double found = (double)rd_scene_view(number).ambient;
        CHECK(fabs(found - (double)image[0]) < 1e-4 * found, "light at %g: %g, not %g", (double)view.light[0], found,
              (double)image[0]);
    }
}
