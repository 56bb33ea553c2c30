/* The most probable maps: what must hold of them. */
#include "tests/support/posterior.h"
#include <float.h>
#include <math.h>

/* J' S^-1 (r - J delta) = Sigma^-1 (R + delta - M), with the inverse of Sigma's blocks written out. */
TEST(posterior_is_where_the_objective_is_flat)
{
    for (int count = 1; count <= MOST; count += 4) {
        job j = begin(32, count);
        run(&j);
        double worst = 0;
        int compared = 0;
        for (int p = 0; p < PIXELS; p++) {
            double maps[C], point[2], delta[C], pull[C], push[C] = {0}, size = 1;
            double digit[C]; /* what a step's last digit does to pull */
            bool inside = true;
            rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
            to_double(j.maps + p * C, maps), to_double(j.step + p * C, delta);
            for (int i = 0; i < C; i++) {
                const int g = group_of[i], first = i < 3 ? 0 : MAP_SPECULAR;
                double s = (double)j.deviation[p * G + g];
                const double away = maps[i] + delta[i] - (double)j.mean[p * C + i];
                CHECK(isfinite(delta[i]), "%d photographs, pixel %d: a step of %g", count, p, delta[i]);
                inside = inside && fabs(maps[i] + delta[i]) < 0.999;
                pull[i] = away / (s * s);
                digit[i] = (double)FLT_EPSILON / (s * s);
                if (g != GROUP_DIFFUSE && g != GROUP_SPECULAR) continue;
                const double q = (double)j.scale.hue[g == GROUP_SPECULAR];
                double sum = 0, w[3]; /* (a I + b 1 1')^-1 = (I - b / (a + 3 b) 1 1') / a */
                s = fmin(s, (double)j.scale.share * tint_of(j.mean + p * C, first, w));
                digit[i] = (double)FLT_EPSILON / (s * s);
                for (int k = first; k < first + 3; k++)
                    sum += (maps[k] + delta[k] - (double)j.mean[p * C + k]) / w[k - first];
                pull[i] = (away / w[i - first] - (1 - q) / (3 - 2 * q) * sum) / (q * s * s * w[i - first]);
                digit[i] /= q * w[i - first] * w[i - first];
            }
            for (int k = 0; k < count && inside; k++) {
                rd_observation o[3];
                rd_observe(maps, point, &j.views[k], j.image[k] + p * 3, &j.scale, o);
                for (int c = 0; c < 3; c++) {
                    double error = o[c].residual;
                    for (int i = 0; i < C; i++) error -= o[c].by[i] * delta[i];
                    for (int i = 0; i < C; i++) {
                        push[i] += o[c].by[i] * error / o[c].variance;
                        size = farther(size, fabs(o[c].by[i] * o[c].residual / o[c].variance));
                    }
                }
            }
            for (int i = 0; i < C && inside; i++) {
                const double apart = fabs(push[i] - pull[i]),
                             off = fmax(apart - digit[i], 0) / fmax(size, fabs(pull[i]));
                worst = farther(worst, off);
                CHECK(isfinite(apart) && isfinite(size) && off < 1e-3,
                      "%d photographs, pixel %d: %g pulls and %g pushes channel %d", count, p, pull[i], push[i], i);
            }
            compared += inside;
        }
        printf("%d photographs: a slope of %.2g at most in %d pixels\n", count, worst, compared);
        CHECK(compared > PIXELS * 9 / 10, "%d photographs: %d of %d pixels are compared", count, compared, PIXELS);
        end(&j);
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

/* A prior that says next to nothing: what a photograph fixes is found as by Newton's method for equations. */
TEST(posterior_without_a_prior_fits_the_photograph)
{
    job j = begin(35, 1);
    ts_rng rng = ts_rng_make(35, TS_STREAM_TEST, 1);
    j.views[0].power = 0.5f; /* nothing is clamped */
    rd_render(rd_grid_full(SIDE), j.truth, C, j.views, true, j.image[0]);
    j.scale = (ts_prior){{1, 1}, 1e-4f, 0, 0, 0};
    for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = 0.5f; /* of changes of .02 */
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
    for (int i = 0; i < PIXELS * G; i++) j.deviation[i] *= 0.1f; /* none is cut to a colour's share */
    j.views[0].power = 100;
    run(&j);
    for (int i = 0; i < PIXELS * C; i++) {
        const float to = fminf(fmaxf(j.mean[i], -1), 1);
        CHECK(fabsf(j.maps[i] + j.step[i] - to) < 3e-7f, "%g, not %g", (double)(j.maps[i] + j.step[i]), (double)to);
    }
    CHECK(!memcmp(j.after, j.deviation, PIXELS * G * sizeof(float)), "a deviation changed");
    end(&j);
}

/* A rounding more or less in the radiance does not decide what a step is. */
TEST(posterior_has_no_edge_where_burning_out_begins)
{
    static const float edge[] = {1, 1 + TS_PRIOR_FADE};
    float *value = floats(PIXELS * 3);
    double worst = 0, moved = 0;
    for (int trial = 0; trial < 60; trial++) {
        job j = begin(38, 1);
        const int p = trial * 37 % PIXELS;
        for (int i = 0; i < PIXELS * 3; i++) j.image[0][i] = 0.95f;
        j.views[0].power = 1;
        rd_render(rd_grid_full(SIDE), j.maps, C, &j.views[0], false, value);
        const float power = edge[trial % 2] / value[p * 3 + trial % 3];
        float step[2][C];
        for (int side = 0; side < 2; side++) {
            j.views[0].power = power * (side ? 1 + 2e-6f : 1 - 2e-6f);
            run(&j);
            memcpy(step[side], j.step + p * C, sizeof step[side]);
        }
        for (int i = 0; i < C; i++) {
            worst = farther(worst, fabs((double)step[1][i] - (double)step[0][i]));
            moved = farther(moved, fabs((double)(j.maps[p * C + i] + step[0][i] - j.mean[p * C + i])));
        }
        end(&j);
    }
    free(value);
    printf("steps across the edges differ by %.2g, and go %.2g from the prior's mean\n", worst, moved);
    CHECK(worst < 2e-4, "a step changes by %g at an edge", worst);
    CHECK(moved > 0.01, "no photograph had an effect");
}

TEST(posterior_moves_tied_colours_together)
{
    job j = begin(37, 2);
    j.scale.hue[0] = j.scale.hue[1] = 0;
    memcpy(j.mean, j.maps, PIXELS * C * sizeof(float));
    run(&j);
    for (int p = 0; p < PIXELS; p++)
        for (int first = 0; first <= MAP_SPECULAR; first += MAP_SPECULAR) {
            const float *by = j.step + p * C + first;
            double w[3];
            bool inside = true;
            tint_of(j.mean + p * C, first, w);
            for (int c = 0; c < 3; c++) inside = inside && fabsf(j.maps[p * C + first + c] + by[c]) < 0.999f;
            for (int c = 0; c < 3 && inside; c++) {
                const double a = (double)by[c] * w[(c + 1) % 3], b = (double)by[(c + 1) % 3] * w[c];
                CHECK(fabs(a - b) < 1e-6, "tied colours go by %g and %g of theirs", a, b);
            }
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
