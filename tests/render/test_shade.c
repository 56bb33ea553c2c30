/* The shading kernels of every instruction set against the double reference (render/brdf.h), and that nothing makes
 * them fail. */
#include "render/kernels/shade.h"
#include "render/rows.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/shading.h"
#include <math.h>

/* Random maps with roughness >= 0.02 and |n_xy| <= 0.999; half of the normals lie within a few widths of the highlight,
 * which random ones would never meet. */
static void accurate_maps(ts_rng *rng, rd_grid grid, const rd_view *view, float *maps)
{
    for (int p = 0; p < grid.h * grid.w; p++) {
        float *m = maps + p * C;
        for (int i = 0; i < C; i++) m[i] = ts_rng_range(rng, -1, 1);
        double r = p % 3 ? (double)ts_rng_range(rng, 0.02f, 1) : 0.02 + 0.1 * (double)ts_rng_uniform(rng), n[2],
               point[2], l[3], v[3], h[3];
        m[MAP_ROUGHNESS] = (float)(2 * r - 1) + 1e-7f;
        rd_centre(grid, p % grid.w, p / grid.w, point);
        rd_light(view, point, l, v);
        for (int k = 0; k < 3; k++) h[k] = l[k] + v[k];
        double length = sqrt(dot3(h, h)), width = r * r * 3 * (double)ts_rng_uniform(rng),
               phi = 6.283 * (double)ts_rng_uniform(rng);
        if (p % 2) {
            n[0] = h[0] / length + width * cos(phi);
            n[1] = h[1] / length + width * sin(phi);
        } else {
            n[0] = (double)m[MAP_NORMAL];
            n[1] = (double)m[MAP_NORMAL + 1];
        }
        double size = sqrt(n[0] * n[0] + n[1] * n[1]), most = size > 0.999 ? 0.999 / size : 1;
        for (int k = 0; k < 2; k++) m[MAP_NORMAL + k] = (float)(n[k] * most);
    }
}

/* Light and camera at most 89 degrees from the normal. */
static bool accurate_pixel(const double m[C], const double point[2], const rd_view *view)
{
    rd_surface s;
    double l[3], v[3];
    rd_decode_double(m, &s);
    rd_light(view, point, l, v);
    return dot3(s.n, l) > 0.0175 && dot3(s.n, v) > 0.0175;
}

/* Largest |a - b| of each kind of map, relative to that kind's largest |b|, or, since the derivatives by roughness and
 * F0 pass through zero while their terms do not, to what those are made of: floor. */
static double gradient_error(const float *a, const double *b, double floor)
{
    static const int first[] = {MAP_DIFFUSE, MAP_NORMAL, MAP_ROUGHNESS, MAP_SPECULAR, C};
    double worst = 0;
    for (int k = 0; k < 4; k++) {
        double error = 0, scale = floor;
        for (int i = first[k]; i < first[k + 1]; i++) {
            error = farther(error, fabs((double)a[i] - b[i]));
            scale = farther(scale, fabs(b[i]));
        }
        worst = fmax(worst, error / scale);
    }
    return worst;
}

TEST(render_kernels_match_reference)
{
    enum { SIDE = 29, ROUNDS = 33 };
    float *maps = floats(SIDE * SIDE * C), *image = floats(SIDE * SIDE * 3), *gradient = floats(SIDE * SIDE * C),
          *base = floats(SIDE * SIDE * 3);
    rd_grid grid = rd_grid_full(SIDE);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        const char *name = ts_isa_name((ts_isa)isa);
        double worst = 0, worst_gradient = 0, worst_log = 0;
        long compared = 0;
        for (int round = 0; round < ROUNDS; round++) {
            ts_rng rng = ts_rng_make(5, TS_STREAM_TEST, (uint64_t)round);
            rd_view view = any_view(&rng, round);
            accurate_maps(&rng, grid, &view, maps);
            rd_render(grid, maps, C, &view, false, image);
            /* A weak light, so that nothing is clamped, and a photograph that is darker by one in one colour: e is
             * exactly that. */
            view.power *= 1e-9f, view.ambient *= 1e-9f;
            int colour = round % 3;
            rd_render(grid, maps, C, &view, false, base);
            for (int i = colour; i < SIDE * SIDE * 3; i += 3) base[i] -= 1;
            ts_shade_view sv = rd_shade_view(&view);
            for (int y = 0; y < SIDE; y++) {
                ts_shade_row row = rd_shade_row(grid, y, maps, C);
                ts_shade_k()->flash(&sv, &row, base + y * SIDE * 3, 1e9f, gradient + y * SIDE * C);
            }
            bool flash = view.kind == RD_POINT;
            view.power *= 1e9f, view.ambient *= 1e9f;
            float black[C] = {-1, -1, -1, 0, 0, 1, -1, -1, -1};
            for (int p = 0; p < SIDE * SIDE; p++) {
                double m[C], point[2], value[3], by[3][C];
                to_double(maps + p * C, m);
                rd_centre(grid, p % SIDE, p / SIDE, point);
                if (!accurate_pixel(m, point, &view)) continue;
                rd_radiance(m, point, &view, value, by);
                compared++;
                for (int c = 0; c < 3; c++) {
                    double error = fabs((double)image[p * 3 + c] - value[c]) / value[c];
                    worst = fmax(worst, error);
                    CHECK(error <= 1e-5, "%s: %.9g instead of %.9g (roughness %g)", name, (double)image[p * 3 + c],
                          value[c], m[MAP_ROUGHNESS] / 2 + 0.5);
                }
                if (flash) {
                    double error = gradient_error(gradient + p * C, by[colour], 0.1 * value[colour]);
                    worst_gradient = fmax(worst_gradient, error);
                    CHECK(error <= 1e-4, "%s: gradient off by %g (roughness %g)", name, error,
                          m[MAP_ROUGHNESS] / 2 + 0.5);
                }
                ts_shade_view one = rd_shade_view(&view);
                ts_shade_row row = rd_shade_row(grid, p / SIDE, maps, C), target;
                row.maps += p % SIDE * C, row.column += p % SIDE, row.count = 1;
                target = row, target.maps = black;
                double dark[C], b[3], sum = 0, expected[C] = {0}, strength = 0;
                float g[C];
                to_double(black, dark);
                rd_radiance(dark, point, &view, b, NULL);
                double got = ts_shade_k()->log_loss(&one, 1, &row, &target, 1, g);
                for (int c = 0; c < 3; c++) {
                    sum += fabs(log(value[c] + 0.01) - log(b[c] + 0.01));
                    strength += value[c] / (value[c] + 0.01);
                    for (int i = 0; i < C; i++)
                        expected[i] += by[c][i] / (value[c] + 0.01) * (value[c] > b[c] ? 1 : -1);
                }
                /* colours of about the same radiance may pull in opposite directions: compared with what each pulls */
                double error = farther(gradient_error(g, expected, 0.1 * strength), fabs(got - sum) / (sum + 0.1) * 10);
                worst_log = fmax(worst_log, error);
                CHECK(error <= 1e-4, "%s: log loss %.9g instead of %.9g, or its gradient, off by %g", name, got, sum,
                      error);
            }
        }
        printf("%s: %ld pixels, worst value %.2g, flash gradient %.2g, log loss %.2g\n", name, compared, worst,
               worst_gradient, worst_log);
        CHECK(compared > 5000, "only %ld pixels were compared", compared);
    }
    free(maps), free(image), free(gradient), free(base);
}

static bool all_finite(const float *p, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(p[i])) return false;
    return true;
}

TEST(render_finite_everywhere)
{
    static const float extreme[] = {-1,         1,          0,           -0.999999f, 0.999999f, -1.0000001f,
                                    1.0000001f, 0.7071068f, -0.7071068f, 0.98f,      -0.98f,    2,
                                    -5,         1e30f,      -1e30f,      3e38f,      -3e38f,    1e-30f,
                                    1e-40f,     -1e-40f,    INFINITY,    -INFINITY,  NAN};
    static const float places[] = {0,      0, 0.5f, -0.5f, 1e-30f, 1e-20f, 1e-6f, -1e-6f,
                                   0.001f, 1, 3,    1e4f,  1e30f,  -1e30f, 1e-40f};
    enum {
        EXTREMES = sizeof extreme / sizeof *extreme,
        PLACES = sizeof places / sizeof *places,
        W = 37,
        VIEWS = 3,
        CH = 10
    };
    float *maps = floats(W * CH), *target = floats(W * CH), *gradient = floats(W * CH), *image = floats(W * 3);
    rd_grid grid = {.h = 1, .w = W, .y0 = 18, .x0 = 0, .side = W}; /* the middle row: a pixel lies at (0, 0) */
    ts_threads_set(1);                                             /* one row at a time */
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        ts_rng rng = ts_rng_make(6, TS_STREAM_TEST, 0);
        double brightest = 0;
        for (int round = 0; round < 1500; round++) {
            for (int i = 0; i < W * CH; i++) {
                maps[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
                target[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
            }
            if (round % 5 == 0)
                for (int i = 0; i < W; i++)
                    maps[i * CH + MAP_NORMAL] = maps[i * CH + MAP_NORMAL + 1] = 0, maps[i * CH + MAP_ROUGHNESS] = -1;
            for (int i = 0; i < W * 3; i++) image[i] = ts_rng_range(&rng, 0, 1);
            rd_view views[VIEWS];
            ts_shade_view sv[VIEWS];
            for (int k = 0; k < VIEWS; k++) {
                views[k] = any_view(&rng, ts_rng_int(&rng, 11));
                if (round % 2) {
                    sv[k] = rd_shade_view(&views[k]);
                    continue;
                }
                views[k] = (rd_view){.kind = (rd_kind)ts_rng_int(&rng, 3), .power = RD_FLASH_POWER};
                for (int j = 0; j < 3; j++) {
                    views[k].light[j] = places[ts_rng_int(&rng, PLACES)];
                    views[k].camera[j] = ts_rng_int(&rng, 3) ? places[ts_rng_int(&rng, PLACES)]
                                                             : -views[k].light[j]; /* often opposite */
                }
                sv[k] = rd_shade_view(&views[k]);
            }
            double rmse;
            rd_flash_gradient(grid, maps, CH, &views[0], image, 0, gradient, &rmse);
            CHECK(isfinite(rmse) && all_finite(gradient, W * CH), "flash gradient, round %d: RMSE %g", round, rmse);
            for (int i = 0; i < W; i++) CHECK(gradient[i * CH + 9] == 0, "the tenth channel has a gradient");
            ts_shade_row row = rd_shade_row(grid, 0, maps, CH), other = rd_shade_row(grid, 0, target, CH);
            double loss = ts_shade_k()->log_loss(sv, VIEWS, &row, &other, 1.0f / (3 * W * VIEWS), gradient);
            CHECK(isfinite(loss) && all_finite(gradient, W * CH), "log loss, round %d: %g", round, loss);
            rd_render(grid, maps, CH, &views[0], false, image);
            CHECK(all_finite(image, W * 3), "radiance, round %d", round);
            for (int i = 0; i < W * 3; i++) {
                CHECK(image[i] >= 0, "negative radiance");
                brightest = fmax(brightest, (double)image[i]);
            }
        }
        CHECK(brightest > 1e6, "the brightest pixel was %g: no extreme was reached", brightest);
    }
    free(maps), free(target), free(gradient), free(image);
}
