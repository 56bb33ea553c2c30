/* The most probable maps, of every instruction set: against the same in double, and what must hold of them. */
#include "render/posterior.h"
#include "render/kernels/newton.h"
#include "tensor/threads.h"
#include "tests/support/normal_equations.h"
#include "tests/support/shading.h"
#include <math.h>
#include <string.h>

enum { SIDE = 19, PIXELS = SIDE * SIDE, MOST = RD_CAPTURE_VIEWS, G = MAP_GROUPS };
static const int group_of[C] = {GROUP_DIFFUSE,   GROUP_DIFFUSE,  GROUP_DIFFUSE,  GROUP_NORMAL,  GROUP_NORMAL,
                                GROUP_ROUGHNESS, GROUP_SPECULAR, GROUP_SPECULAR, GROUP_SPECULAR};

typedef struct job {
    float *truth, *maps, *mean, *deviation, *step, *after, *image[MOST];
    rd_view views[MOST];
    int count;
    ts_prior scale;
} job;

static job begin(uint64_t seed, int count)
{
    job j = {.truth = floats(PIXELS * C),
             .maps = floats(PIXELS * C),
             .mean = floats(PIXELS * C),
             .deviation = floats(PIXELS * G),
             .step = floats(PIXELS * C),
             .after = floats(PIXELS * G),
             .count = count,
             .scale = {{0.2f, 0.1f}, 0.1f, 0.5f, 0.3f}};
    ts_rng rng = ts_rng_make(seed, TS_STREAM_TEST, (uint64_t)count);
    rd_capture_draw(&rng, count, j.views);
    for (int p = 0; p < PIXELS * C; p++) {
        const int i = p % C;
        const float low = i == MAP_ROUGHNESS ? -0.4f : i == MAP_NORMAL || i == MAP_NORMAL + 1 ? -0.5f : -0.8f;
        j.truth[p] = ts_rng_range(&rng, low, -low);
        j.maps[p] = ts_rng_range(&rng, low, -low);
        j.mean[p] = j.maps[p] + ts_rng_range(&rng, -0.1f, 0.1f);
    }
    for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = ts_rng_range(&rng, 0.05f, 0.5f);
    for (int k = 0; k < count; k++) {
        j.image[k] = floats(PIXELS * 3);
        rd_render(rd_grid_full(SIDE), j.truth, C, &j.views[k], true, j.image[k]);
    }
    return j;
}

static void end(job *j)
{
    for (int k = 0; k < j->count; k++) free(j->image[k]);
    free(j->truth), free(j->maps), free(j->mean), free(j->deviation), free(j->step), free(j->after);
}

static void run(job *j)
{
    const rd_prior prior = {j->mean, j->deviation, j->scale};
    rd_posterior_step(rd_grid_full(SIDE), j->maps, C, j->views, (const float *const *)j->image, j->count, &prior,
                      j->step, j->after);
}

/* The double twin's result for pixel p. */
static void expect(const job *j, int p, double mean[C], double covariance[C][C])
{
    double maps[C], point[2], deviation[G];
    float image[MOST][3];
    rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
    to_double(j->maps + p * C, maps), to_double(j->mean + p * C, mean);
    for (int g = 0; g < G; g++) deviation[g] = (double)j->deviation[p * G + g];
    for (int k = 0; k < j->count; k++) memcpy(image[k], j->image[k] + p * 3, sizeof image[k]);
    rd_prior_covariance(deviation, &j->scale, covariance);
    rd_posterior_pixel(maps, point, j->views, (const float(*)[3])image, j->count, &j->scale, mean, covariance);
}

/* Some of everything that is an edge: no deviation, clamped maps, burnt out photographs, no hue, all hue. */
static void sharpen(job *j, ts_rng *rng)
{
    static const float hues[] = {0, 1e-3f, 0.3f, 1};
    for (int i = 0; i < 2; i++) j->scale.hue[i] = hues[ts_rng_int(rng, 4)];
    for (int i = 0; i < PIXELS * G; i++)
        if (!ts_rng_int(rng, 5)) j->deviation[i] = ts_rng_int(rng, 2) ? 0 : 1e-4f;
    for (int i = 0; i < PIXELS * C; i++)
        if (!ts_rng_int(rng, 30) && i % C != MAP_ROUGHNESS) j->maps[i] = ts_rng_int(rng, 2) ? 1.01f : -1;
    for (int k = 0; k < j->count; k++)
        for (int i = 0; i < PIXELS * 3; i++)
            if (!ts_rng_int(rng, 6)) j->image[k][i] = (float)ts_rng_int(rng, 2);
}

TEST(posterior_equals_its_double_twin)
{
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        double worst = 0, worst_after = 0;
        for (int round = 0; round < 8; round++) {
            job j = begin(30, 1 + round % 4 * 2);
            ts_rng rng = ts_rng_make(31, TS_STREAM_TEST, (uint64_t)round);
            sharpen(&j, &rng);
            run(&j);
            for (int p = 0; p < PIXELS; p++) {
                double mean[C], covariance[C][C], variance[G] = {0};
                static const double members[G] = {3, 2, 1, 3};
                expect(&j, p, mean, covariance);
                for (int i = 0; i < C; i++) {
                    const double at = (double)j.maps[p * C + i],
                                 error = fabs((double)j.step[p * C + i] - (fmin(fmax(mean[i], -1), 1) - at));
                    variance[group_of[i]] += covariance[i][i] / members[group_of[i]];
                    worst = fmax(worst, error);
                    CHECK(error <= 5e-5, "%s, round %d: channel %d of pixel %d goes by %g, not to %g",
                          ts_isa_name((ts_isa)isa), round, i, p, (double)j.step[p * C + i], mean[i]);
                }
                for (int g = 0; g < G; g++) {
                    const double left = (double)j.after[p * G + g], error = fabs(left - sqrt(fmax(variance[g], 0)));
                    worst_after = fmax(worst_after, error);
                    CHECK(error <= 2e-5, "%s, round %d: group %d of pixel %d is left with %g, not %g",
                          ts_isa_name((ts_isa)isa), round, g, p, left, sqrt(variance[g]));
                    CHECK(j.after[p * G + g] <= j.deviation[p * G + g], "group %d is less certain afterwards", g);
                }
            }
            end(&j);
        }
        printf("%s: maps off by %.2g at most, deviations by %.2g\n", ts_isa_name((ts_isa)isa), worst, worst_after);
    }
}

/* Maps outside [-1, 1], at its ends and a rounding beyond lead where those that are cut lead: rounding decides nothing.
 */
TEST(posterior_starts_inside)
{
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int count = 1; count <= 5; count += 4) {
            job j = begin(34, count), inside = begin(34, count);
            ts_rng rng = ts_rng_make(35, TS_STREAM_TEST, (uint64_t)count);
            push_out(&rng, PIXELS, j.maps, inside.maps);
            run(&j), run(&inside);
            for (int i = 0; i < PIXELS * C; i++)
                CHECK(fabsf((j.maps[i] + j.step[i]) - (inside.maps[i] + inside.step[i])) <= 1e-6f,
                      "%s, %d photographs: channel %d of pixel %d goes from %.9g to %g, from %g to %g",
                      ts_isa_name((ts_isa)isa), count, i % C, i / C, (double)j.maps[i], (double)(j.maps[i] + j.step[i]),
                      (double)inside.maps[i], (double)(inside.maps[i] + inside.step[i]));
            CHECK(!memcmp(j.after, inside.after, PIXELS * G * sizeof *j.after), "other doubts");
            end(&j), end(&inside);
        }
    }
}

/* J' S^-1 (r - J delta) = Sigma^-1 (R + delta - M), with the inverse of Sigma's blocks written out. */
TEST(posterior_is_where_the_objective_is_flat)
{
    for (int count = 1; count <= MOST; count += 4) {
        job j = begin(32, count);
        run(&j);
        double worst = 0;
        for (int p = 0; p < PIXELS; p++) {
            double maps[C], point[2], delta[C], pull[C], push[C] = {0}, size = 1;
            bool inside = true;
            rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
            to_double(j.maps + p * C, maps), to_double(j.step + p * C, delta);
            for (int i = 0; i < C; i++) {
                const int g = group_of[i], first = i < 3 ? 0 : MAP_SPECULAR;
                const double s = (double)j.deviation[p * G + g], away = maps[i] + delta[i] - (double)j.mean[p * C + i];
                inside = inside && fabs(maps[i] + delta[i]) < 0.999;
                pull[i] = away / (s * s);
                if (g != GROUP_DIFFUSE && g != GROUP_SPECULAR) continue;
                const double q = (double)j.scale.hue[g == GROUP_SPECULAR];
                double sum = 0; /* (a I + b 1 1')^-1 = (I - b / (a + 3 b) 1 1') / a */
                for (int k = first; k < first + 3; k++) sum += maps[k] + delta[k] - (double)j.mean[p * C + k];
                pull[i] = (away - (1 - q) / (3 - 2 * q) * sum) / (q * s * s);
            }
            for (int k = 0; k < count && inside; k++) {
                rd_observation o[3];
                rd_observe(maps, point, &j.views[k], j.image[k] + p * 3, &j.scale, o);
                for (int c = 0; c < 3; c++) {
                    double error = o[c].residual;
                    for (int i = 0; i < C; i++) error -= o[c].by[i] * delta[i];
                    for (int i = 0; i < C; i++) {
                        push[i] += o[c].by[i] * error / o[c].variance;
                        size = fmax(size, fabs(o[c].by[i] * o[c].residual / o[c].variance));
                    }
                }
            }
            for (int i = 0; i < C && inside; i++) {
                const double off = fabs(push[i] - pull[i]) / fmax(size, fabs(pull[i]));
                worst = fmax(worst, off);
                CHECK(off < 1e-3, "%d photographs, pixel %d: %g pulls and %g pushes channel %d", count, p, pull[i],
                      push[i], i);
            }
        }
        printf("%d photographs: a slope of %.2g at most\n", count, worst);
        end(&j);
    }
}

TEST(posterior_is_newtons_step_for_equal_priors)
{
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int count = 1; count <= MOST; count += 4) {
            job j = begin(33, count);
            float damping[C], *newton = floats(PIXELS * C);
            static const float of[G] = {0.5f, 4, 1, 2};
            j.scale = (ts_prior){{1, 1}, sqrtf(TS_NEWTON_NOISE), 1, 0};
            for (int i = 0; i < C; i++) damping[i] = of[group_of[i]];
            for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = 1 / sqrtf(of[i % G]);
            memcpy(j.mean, j.maps, PIXELS * C * sizeof(float));
            run(&j);
            rd_newton_step(rd_grid_full(SIDE), j.maps, C, j.views, (const float *const *)j.image, count, damping,
                           newton);
            for (int i = 0; i < PIXELS * C; i++)
                CHECK(fabsf(j.step[i] - newton[i]) < 3e-5f, "%s: channel %d goes by %g, Newton's by %g",
                      ts_isa_name((ts_isa)isa), i % C, (double)j.step[i], (double)newton[i]);
            free(newton), end(&j);
        }
    }
}

TEST(posterior_without_doubt_is_the_mean)
{
    job j = begin(34, 3);
    memset(j.deviation, 0, PIXELS * G * sizeof(float));
    run(&j);
    for (int i = 0; i < PIXELS * C; i++) {
        const float to = fminf(fmaxf(j.mean[i], -1), 1);
        CHECK(fabsf(j.maps[i] + j.step[i] - to) < 3e-7f, "%g, not %g", (double)(j.maps[i] + j.step[i]), (double)to);
    }
    for (int i = 0; i < PIXELS * G; i++) CHECK(j.after[i] == 0, "a deviation of %g from none", (double)j.after[i]);
    end(&j);
}

/* A prior that says nothing: what a photograph fixes is found as by Newton's method for equations. */
TEST(posterior_without_a_prior_fits_the_photograph)
{
    job j = begin(35, 1);
    ts_rng rng = ts_rng_make(35, TS_STREAM_TEST, 1);
    j.views[0].power = 0.5f; /* nothing is clamped */
    rd_render(rd_grid_full(SIDE), j.truth, C, j.views, true, j.image[0]);
    j.scale = (ts_prior){{1, 1}, 1e-4f, 0, 0};
    for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = 100;
    for (int i = 0; i < PIXELS * C; i++) j.maps[i] = j.truth[i] + ts_rng_range(&rng, -0.02f, 0.02f);
    double rmse[3];
    for (int t = 0; t < 3; t++) {
        rd_flash_rmse(rd_grid_full(SIDE), j.maps, C, j.views, j.image[0], &rmse[t]);
        memcpy(j.mean, j.maps, PIXELS * C * sizeof(float));
        run(&j);
        for (int i = 0; i < PIXELS * C; i++) j.maps[i] += j.step[i];
    }
    printf("off by %.2g, %.2g, %.2g\n", rmse[0], rmse[1], rmse[2]);
    CHECK(rmse[1] < 0.1 * rmse[0] && rmse[2] < 0.1 * rmse[1] && rmse[2] < 1e-4, "%g, %g, %g", rmse[0], rmse[1],
          rmse[2]);
    end(&j);
}

TEST(posterior_learns_nothing_where_both_are_burnt_out)
{
    job j = begin(36, 1);
    for (int i = 0; i < PIXELS * 3; i++) j.image[0][i] = 0.95f;
    for (int i = 0; i < PIXELS * C; i++)
        if (group_of[i % C] == GROUP_DIFFUSE) j.maps[i] = 0.9f;
        else if (group_of[i % C] == GROUP_SPECULAR) j.maps[i] = -0.9f;
    j.views[0].power = 100;
    run(&j);
    for (int i = 0; i < PIXELS * C; i++) {
        const float to = fminf(fmaxf(j.mean[i], -1), 1);
        CHECK(fabsf(j.maps[i] + j.step[i] - to) < 3e-7f, "%g, not %g", (double)(j.maps[i] + j.step[i]), (double)to);
    }
    CHECK(!memcmp(j.after, j.deviation, PIXELS * G * sizeof(float)), "a deviation changed");
    end(&j);
}

TEST(posterior_moves_tied_colours_together)
{
    job j = begin(37, 2);
    j.scale.hue[0] = j.scale.hue[1] = 0;
    memcpy(j.mean, j.maps, PIXELS * C * sizeof(float));
    run(&j);
    for (int p = 0; p < PIXELS; p++)
        for (int first = 0; first <= MAP_SPECULAR; first += MAP_SPECULAR) {
            float low = INFINITY, high = -INFINITY;
            bool inside = true;
            for (int i = p * C + first; i < p * C + first + 3; i++) {
                low = fminf(low, j.step[i]), high = fmaxf(high, j.step[i]);
                inside = inside && fabsf(j.maps[i] + j.step[i]) < 0.999f;
            }
            if (inside) CHECK(high - low < 1e-6f, "tied colours go by %g to %g", (double)low, (double)high);
        }
    end(&j);
}

/* A grey material in a grey photograph stays grey, and red and blue may change places. */
TEST(posterior_treats_colours_alike)
{
    job j = begin(38, 2), other = begin(38, 2);
    static const int swapped[C] = {2, 1, 0, 3, 4, 5, 8, 7, 6};
    for (int p = 0; p < PIXELS; p++) {
        for (int i = 0; i < C; i++) {
            other.maps[p * C + i] = j.maps[p * C + swapped[i]];
            other.mean[p * C + i] = j.mean[p * C + swapped[i]];
        }
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++) other.image[k][p * 3 + c] = j.image[k][p * 3 + 2 - c];
    }
    run(&j), run(&other);
    for (int i = 0; i < PIXELS * C; i++) {
        const float a = j.step[i], b = other.step[i / C * C + swapped[i % C]];
        CHECK(fabsf(a - b) < 2e-5f, "channel %d goes by %g, and by %g with red and blue exchanged", i % C, (double)a,
              (double)b);
    }
    for (int p = 0; p < PIXELS; p++)
        for (int c = 1; c < 3; c++) {
            for (int first = 0; first <= MAP_SPECULAR; first += MAP_SPECULAR) {
                j.maps[p * C + first + c] = j.maps[p * C + first];
                j.mean[p * C + first + c] = j.mean[p * C + first];
            }
            for (int k = 0; k < 2; k++) j.image[k][p * 3 + c] = j.image[k][p * 3];
        }
    run(&j);
    for (int p = 0; p < PIXELS; p++)
        for (int i = 0; i < C; i++)
            if (i < 3 || i >= MAP_SPECULAR) {
                const float a = j.step[p * C + i], b = j.step[p * C + (i < 3 ? 0 : MAP_SPECULAR)];
                CHECK(fabsf(a - b) < 2e-5f, "grey becomes coloured: %g, %g", (double)a, (double)b);
            }
    end(&j), end(&other);
}

/* With the same slopes a photograph more leaves no more doubt. */
TEST(posterior_is_surer_with_more_photographs)
{
    job j = begin(39, MOST);
    float *before = floats(PIXELS * G);
    memcpy(before, j.deviation, PIXELS * G * sizeof(float));
    for (int count = 1; count <= MOST; count++) {
        job part = j;
        part.count = count;
        run(&part);
        for (int i = 0; i < PIXELS * G; i++)
            CHECK(j.after[i] <= before[i] * 1.00001f, "photograph %d leads from %g to %g", count, (double)before[i],
                  (double)j.after[i]);
        memcpy(before, j.after, PIXELS * G * sizeof(float));
    }
    free(before), end(&j);
}

TEST(posterior_is_the_same_for_any_number_of_threads)
{
    job j = begin(40, 3);
    float *step = floats(PIXELS * C), *after = floats(PIXELS * G);
    for (int threads = 1; threads <= 5; threads += 2) {
        ts_threads_set(threads);
        run(&j);
        if (threads == 1) {
            memcpy(step, j.step, PIXELS * C * sizeof(float)), memcpy(after, j.after, PIXELS * G * sizeof(float));
        }
        CHECK(!memcmp(step, j.step, PIXELS * C * sizeof(float)) && !memcmp(after, j.after, PIXELS * G * sizeof(float)),
              "other bytes with %d threads", threads);
    }
    ts_threads_set(0);
    free(step), free(after), end(&j);
}

TEST(posterior_is_finite_everywhere)
{
    static const float extreme[] = {-1, 1, 0, -0.999999f, 0.999999f, -1.0000001f, 0.98f, -0.98f, 2, -5, 1e30f, 1e-40f};
    static const float places[] = {0, 0, 0.5f, -0.5f, 1e-20f, 1e-6f, 0.001f, 1, 3, 1e4f, 1e30f, -1e30f, 1e-40f};
    static const float widths[] = {0, 1e-20f, 1e-3f, 1, 1e3f, 1e30f, INFINITY, -1, NAN};
    enum { EXTREMES = sizeof extreme / sizeof *extreme, PLACES = sizeof places / sizeof *places };
    enum { WIDTHS = sizeof widths / sizeof *widths };
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        job j = begin(41, MOST);
        ts_rng rng = ts_rng_make(42, TS_STREAM_TEST, 0);
        for (int round = 0; round < 100; round++) {
            job part = j;
            part.count = 1 + round % MOST;
            part.scale = (ts_prior){{ts_rng_uniform(&rng), (float)ts_rng_int(&rng, 2)},
                                    ts_rng_int(&rng, 2) ? 0 : 0.1f,
                                    ts_rng_int(&rng, 2) ? 0 : 1,
                                    ts_rng_int(&rng, 2) ? 0 : 0.5f};
            for (int i = 0; i < PIXELS * C; i++) {
                j.maps[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
                j.mean[i] = ts_rng_int(&rng, 3) ? j.maps[i] : ts_rng_range(&rng, -1, 1);
            }
            for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = widths[ts_rng_int(&rng, WIDTHS)];
            for (int k = 0; k < part.count; k++)
                for (int i = 0; i < 3; i++) {
                    part.views[k].light[i] = places[ts_rng_int(&rng, PLACES)];
                    part.views[k].camera[i] = ts_rng_int(&rng, 3) ? places[ts_rng_int(&rng, PLACES)]
                                                                  : part.views[k].light[i];
                }
            run(&part);
            for (int i = 0; i < PIXELS * C; i++) {
                const float to = j.maps[i] + j.step[i];
                CHECK(to >= -1.0001f && to <= 1.0001f, "%s, round %d: channel %d goes from %g by %g",
                      ts_isa_name((ts_isa)isa), round, i % C, (double)j.maps[i], (double)j.step[i]);
            }
            for (int i = 0; i < PIXELS * G; i++)
                CHECK(j.after[i] >= 0 && j.after[i] <= TS_PRIOR_WIDEST, "%s, round %d: a deviation of %g",
                      ts_isa_name((ts_isa)isa), round, (double)j.after[i]);
        }
        end(&j);
    }
}
