/* The most probable maps, of every instruction set: against the same in double, Newton's step, and for any input. */
#include "render/kernels/newton.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/posterior.h"
#include <math.h>

/* The double twin's result for pixel p. */
static void expect(const job *j, int p, double mean[C], double covariance[C][C])
{
    double maps[C], point[2], deviation[G];
    float image[MOST][3];
    rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
    to_double(j->maps + p * C, maps), to_double(j->mean + p * C, mean);
    for (int g = 0; g < G; g++) deviation[g] = (double)j->deviation[p * G + g];
    for (int k = 0; k < j->count; k++) memcpy(image[k], j->image[k] + p * 3, sizeof image[k]);
    rd_prior_covariance(deviation, mean, &j->scale, covariance);
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

TEST(posterior_is_newtons_step_for_equal_priors)
{
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int count = 1; count <= MOST; count += 4) {
            job j = begin(33, count);
            float damping[C], *newton = floats(PIXELS * C);
            static const float of[G] = {150, 120, 100, 110}; /* deviations below those of the darkest colours */
            j.scale = (ts_prior){{1, 1}, sqrtf(TS_NEWTON_NOISE), 1, 0, 0};
            for (int i = 0; i < C; i++) damping[i] = of[group_of[i]];
            for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = 1 / sqrtf(of[i % G]);
            for (int i = 0; i < PIXELS * C; i++) /* of grey maps W is 1 */
                if (group_of[i % C] == GROUP_DIFFUSE || group_of[i % C] == GROUP_SPECULAR)
                    j.maps[i] = j.maps[i / C * C + (i % C < 3 ? 0 : MAP_SPECULAR)];
            memcpy(j.mean, j.maps, PIXELS * C * sizeof(float));
            for (int i = 0; i < PIXELS * 3 * count; i++) { /* of what is burnt out Newton's step fades nothing */
                float *value = &j.image[i / (PIXELS * 3)][i % (PIXELS * 3)];
                *value = fminf(*value, TS_NEWTON_BURNT - 0.01f);
            }
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
                                    ts_rng_int(&rng, 2) ? 0 : 0.5f,
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
