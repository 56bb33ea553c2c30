/* A photograph as a function of its scene, of every instruction set, and what is found of the scene from it. */
#include "render/ambient.h"
#include "render/kernels/newton.h"
#include "render/rows.h"
#include "render/scene_model.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/normal_equations.h"
#include "tests/support/shading.h"
#include <math.h>
#include <string.h>

enum { SIDE = 48, PIXELS = SIDE * SIDE, K = RD_SCENE_UNKNOWNS, G = MAP_GROUPS };

static void random_maps(ts_rng *rng, float *maps)
{
    for (int i = 0; i < PIXELS * C; i++) {
        const int m = i % C;
        const bool normal = m == MAP_NORMAL || m == MAP_NORMAL + 1;
        maps[i] = m >= MAP_SPECULAR ? ts_rng_range(rng, -0.95f, -0.6f)
            : m == MAP_ROUGHNESS    ? ts_rng_range(rng, -0.3f, 0.4f)
                                    : ts_rng_range(rng, -0.2f, 0.2f) * (normal ? 1 : 3);
    }
}

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
            random_maps(&rng, maps), random_numbers(&rng, number);
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
            random_maps(&rng, maps), random_numbers(&rng, number), random_numbers(&rng, truth);
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

typedef struct job {
    float *maps, *deviation, *image, truth[K];
    rd_scene_prior prior;
    rd_scene_how how;
} job;

/* The photograph of maps that are as rough as is true. */
static void photograph(job *j, const float *maps)
{
    float *rough = floats(PIXELS * C);
    rd_scene_roughen(PIXELS, maps, C, j->truth[RD_SCENE_ROUGHNESS], 1, rough);
    rd_scene_photograph(rd_grid_full(SIDE), rough, C, j->truth, true, j->image);
    free(rough);
}

/* A photograph, and a prior of a camera that is about the usual one. */
static job begin(uint64_t round)
{
    static const float deviation[K] = {0.5f, 1, 1, 0.5f, 0.5f, 1.5f, 1, 0.3f, 0.2f};
    ts_rng rng = ts_rng_make(52, TS_STREAM_TEST, round);
    job j = {.maps = floats(PIXELS * C),
             .deviation = floats(PIXELS * G),
             .image = floats(PIXELS * 3),
             .how = {8, 1, 1, {{0.1f, 0.1f}, 0.01f, 0.001f}}};
    random_maps(&rng, j.maps);
    memcpy(j.prior.deviation, deviation, sizeof deviation);
    for (int i = 0; i < K; i++) j.truth[i] = deviation[i] * ts_rng_range(&rng, -1, 1);
    j.truth[RD_SCENE_AMBIENT] = fabsf(j.truth[RD_SCENE_AMBIENT]);
    memset(j.deviation, 0, PIXELS * G * sizeof(float));
    photograph(&j, j.maps);
    return j;
}

static void end(job *j) { free(j->maps), free(j->deviation), free(j->image); }

static void fit(const job *j, float number[K], float after[K])
{
    memcpy(number, j->prior.mean, K * sizeof *number);
    rd_scene_fit(rd_grid_full(SIDE), j->maps, C, j->deviation, j->image, &j->prior, &j->how, number, after);
}

/* The photograph becomes one of maps that are off those that are known by what deviation says, colours together. */
static void disturb(job *j, ts_rng *rng, float deviation, bool relief)
{
    float *other = floats(PIXELS * C);
    for (int p = 0; p < PIXELS; p++) {
        const float diffuse = ts_rng_normal(rng), specular = ts_rng_normal(rng);
        for (int i = 0; i < C; i++) {
            const float x = i < 3 ? diffuse : i >= MAP_SPECULAR ? specular : ts_rng_normal(rng);
            const bool normal = i == MAP_NORMAL || i == MAP_NORMAL + 1;
            other[p * C + i] = j->maps[p * C + i] +
                deviation * x *
                    (i >= MAP_SPECULAR       ? 0.2f
                         : normal && !relief ? 0
                                             : 1);
        }
        for (int g = 0; g < G; g++)
            j->deviation[p * G + g] = deviation * (g == GROUP_SPECULAR ? 0.2f : g == GROUP_NORMAL && !relief ? 0 : 1);
    }
    j->how.scale.hue[0] = j->how.scale.hue[1] = 0;
    photograph(j, other);
    free(other);
}

TEST(scene_is_found_from_true_maps)
{
    double worst[K] = {0};
    for (uint64_t round = 0; round < 12; round++) {
        job j = begin(round);
        float number[K], after[K];
        fit(&j, number, after);
        for (int i = 0; i < K; i++) {
            worst[i] = farther(worst[i], fabs((double)number[i] - (double)j.truth[i]));
            CHECK(fabsf(number[i] - j.truth[i]) < 0.02f, "round %d: number %d is %g, not %g", (int)round, i,
                  (double)number[i], (double)j.truth[i]);
            CHECK(after[i] > 0 && after[i] < j.prior.deviation[i], "number %d is left with %g", i, (double)after[i]);
        }
        end(&j);
    }
    for (int i = 0; i < K; i++) printf("%s%.2g", i ? " " : "off by at most ", worst[i]);
    printf("\n");
}

/* Of a material that is off its maps by what is said of it: less certain than from true maps, and off by no more than
 * it says, to either side alike. Relief that the maps lack widens highlights, which the level takes for roughness: of
 * maps whose normals are off, the level is not looked at. */
static void from_uncertain_maps(bool relief)
{
    enum { ROUNDS = 40 };
    const int looked_at = relief ? RD_SCENE_NUMBERS : K;
    double sum[K] = {0}, squares[K] = {0}, ratio = INFINITY;
    for (uint64_t round = 0; round < ROUNDS; round++) {
        job j = begin(round);
        ts_rng rng = ts_rng_make(53, TS_STREAM_TEST, round);
        float number[K], after[K], sure[K];
        j.truth[RD_SCENE_EXPOSURE] = -0.5f - fabsf(j.truth[RD_SCENE_EXPOSURE]); /* next to nothing is burnt out */
        j.how.every = 6; /* of more pixels what is not linear would be seen */
        photograph(&j, j.maps);
        fit(&j, number, sure);
        disturb(&j, &rng, 0.05f, relief);
        fit(&j, number, after);
        for (int i = 0; i < K; i++) {
            const double z = ((double)number[i] - (double)j.truth[i]) / (double)after[i];
            sum[i] += z / ROUNDS, squares[i] += z * z / ROUNDS;
            ratio = fmin(ratio, (double)after[i] / (double)sure[i]);
        }
        end(&j);
    }
    for (int i = 0; i < K; i++) printf("number %d: off by %.2f +- %.2f of what is said\n", i, sum[i], sqrt(squares[i]));
    for (int i = 0; i < looked_at; i++) {
        CHECK(fabs(sum[i]) < 1, "number %d is off by %.2f deviations on average", i, sum[i]);
        CHECK(squares[i] < 4, "number %d is off by %.2f deviations", i, sqrt(squares[i]));
    }
    CHECK(ratio > 1, "as certain from uncertain maps: %g", ratio);
}

TEST(scene_is_found_from_uncertain_maps) { from_uncertain_maps(true); }
TEST(scene_is_found_from_uncertain_colours_and_gloss) { from_uncertain_maps(false); }

TEST(scene_level_is_a_factor_on_the_roughness)
{
    static const float level[] = {0, -0.7f, 0.4f, 3};
    float *maps = floats(PIXELS * C), *to = floats(PIXELS * C);
    ts_rng rng = ts_rng_make(55, TS_STREAM_TEST, 0);
    random_maps(&rng, maps);
    for (size_t k = 0; k < sizeof level / sizeof *level; k++) {
        rd_scene_roughen(PIXELS, maps, C, level[k], 1, to);
        for (int i = 0; i < PIXELS * C; i++) {
            const double want = i % C != MAP_ROUGHNESS ? (double)maps[i]
                                                       : fmin(((double)maps[i] + 1) * exp((double)level[k]) - 1, 1);
            CHECK(fabs((double)to[i] - want) < 1e-6, "level %g: %g, not %g", (double)level[k], (double)to[i], want);
        }
    }
    rd_scene_roughen(PIXELS, maps, C, level[3], 1, maps);
    CHECK(!memcmp(maps, to, PIXELS * C * sizeof *to), "in place it is another");
    free(maps), free(to);
}

TEST(scene_without_doubt_stays)
{
    job j = begin(1);
    float number[K], after[K];
    memset(j.prior.deviation, 0, sizeof j.prior.deviation);
    fit(&j, number, after);
    for (int i = 0; i < K; i++)
        CHECK(number[i] == j.prior.mean[i] && after[i] == 0, "number %d is %g +- %g", i, (double)number[i],
              (double)after[i]);
    end(&j);
}

TEST(scene_is_the_same_for_any_number_of_threads)
{
    job j = begin(2);
    float number[2][K], after[2][K];
    j.how.every = 3, j.how.correlated = 10;
    for (int threads = 1; threads <= 5; threads += 2) {
        ts_threads_set(threads);
        fit(&j, number[threads > 1], after[threads > 1]);
        CHECK(threads == 1 ||
                  (!memcmp(number[0], number[1], sizeof number[0]) && !memcmp(after[0], after[1], sizeof after[0])),
              "other bytes with %d threads", threads);
    }
    ts_threads_set(0);
    end(&j);
}

TEST(scene_fit_is_finite)
{
    static const float extreme[] = {-1, 1, 0, -0.999999f, 0.999999f, 2, -5, 1e30f, -1e30f, 1e-40f};
    static const float widths[] = {0, 1e-20f, 0.1f, 1, 1e30f, INFINITY, -1, NAN};
    enum { EXTREMES = sizeof extreme / sizeof *extreme, WIDTHS = sizeof widths / sizeof *widths };
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        job j = begin(3);
        ts_rng rng = ts_rng_make(54, TS_STREAM_TEST, 0);
        for (int round = 0; round < 40; round++) {
            float number[K], after[K];
            for (int i = 0; i < PIXELS * C; i++)
                j.maps[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
            for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = widths[ts_rng_int(&rng, WIDTHS)];
            for (int i = 0; i < PIXELS * 3; i++)
                j.image[i] = round % 4 < 2 ? (float)(round % 2) : ts_rng_range(&rng, 0, 1);
            j.how = (rd_scene_how){
                6, 1 + round % 3, 10, {{0.1f, 0}, round % 5 ? 0.1f : 0, round % 3 ? 0.1f : 0, round % 4 ? 0 : 0.2f, 0}};
            fit(&j, number, after);
            for (int i = 0; i < K; i++)
                CHECK(fabsf(number[i]) <= 6 && after[i] >= 0 && after[i] <= j.prior.deviation[i] * 1.00001f,
                      "%s, round %d: number %d is %g +- %g", ts_isa_name((ts_isa)isa), round, i, (double)number[i],
                      (double)after[i]);
        }
        end(&j);
    }
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
