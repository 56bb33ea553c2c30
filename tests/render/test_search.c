/* How far steps go: those of one photograph, and the search of several. */
#include "tensor/cpu.h"
#include "tests/support/posterior.h"
#include <math.h>

enum { VIEWS = 5, STEPS = 24 };

/* E of render/posterior.h, in double. */
static double misfit(const job *j, int pixel, const float *maps)
{
    const double point[2] = {(pixel % SIDE + 0.5) / SIDE - 0.5, 0.5 - (pixel / SIDE + 0.5) / SIDE};
    double m[C], off[C], sum = 0;
    for (int i = 0; i < C; i++) m[i] = (double)maps[i], off[i] = m[i] - (double)j->mean[pixel * C + i];
    for (int k = 0; k < j->count; k++) {
        rd_observation o[3];
        rd_observe(m, point, &j->views[k], j->image[k] + pixel * 3, &j->scale, o);
        for (int c = 0; c < 3; c++) sum += o[c].residual * o[c].residual / o[c].variance;
    }
    const float *deviation = j->deviation + pixel * G;
    for (int k = 0; k < 2; k++) { /* ((1 - q) 1 1' + q I)^-1 = (I - (1 - q) / (3 - 2 q) 1 1') / q */
        const int first = k ? MAP_SPECULAR : MAP_DIFFUSE;
        double w[3], v[3], all = 0;
        const double widest = tint_of(j->mean + pixel * C, first, w);
        for (int c = 0; c < 3; c++) all += v[c] = off[first + c] / w[c];
        const double q = (double)j->scale.hue[k],
                     s = j->scale.share > 0
            ? fmin((double)deviation[k ? GROUP_SPECULAR : GROUP_DIFFUSE], (double)j->scale.share * widest)
            : (double)deviation[k ? GROUP_SPECULAR : GROUP_DIFFUSE];
        sum += (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - (1 - q) / (3 - 2 * q) * all * all) / (q * s * s);
    }
    for (int i = 0; i < C; i++)
        if (group_of[i] == GROUP_NORMAL || group_of[i] == GROUP_ROUGHNESS)
            sum += pow(off[i] / (double)deviation[group_of[i]], 2);
    return sum;
}

/* Careful photographs: of them whole steps overshoot. */
static job careful(uint64_t seed)
{
    job j = begin(seed, VIEWS);
    j.scale = (ts_prior){{0.2f, 0.1f}, 0.01f, 0.002f, 0, 0};
    return j;
}

static void step(job *j, float length, const rd_search *search)
{
    const rd_prior prior = {j->mean, j->deviation, j->scale};
    rd_posterior_step(rd_grid_full(SIDE), j->maps, C, j->views, (const float *const *)j->image, j->count, &prior,
                      length, search, j->step, NULL);
}

/* The sum of all pixels' misfits after as many whole steps. */
static double without_search(uint64_t seed)
{
    job j = careful(seed);
    double sum = 0;
    for (int t = 0; t < STEPS; t++) {
        step(&j, 1, NULL);
        for (int i = 0; i < PIXELS * C; i++) j.maps[i] += j.step[i];
    }
    for (int p = 0; p < PIXELS; p++) sum += misfit(&j, p, j.maps + p * C);
    end(&j);
    return sum;
}

/* What is kept of a pixel is maps that were tried and their misfit, which never rises; from worse ones the step goes
 * back towards them, from better ones on by a part of the whole step. */
TEST(search_keeps_the_best_maps_of_each_pixel)
{
    job j = careful(91);
    float *best = floats(PIXELS * C), *least = floats(PIXELS), *before = floats(PIXELS), *kept = floats(PIXELS * C);
    rd_search search = {best, least, false};
    int back = 0, on = 0;
    double first = 0, last = 0;
    for (int i = 0; i < PIXELS * C; i++) kept[i] = j.maps[i];
    for (int t = 0; t < STEPS; t++) {
        float *whole = floats(PIXELS * C);
        step(&j, 1, NULL);
        memcpy(whole, j.step, PIXELS * C * sizeof *whole);
        step(&j, rd_step_length(VIEWS, t), &search);
        for (int p = 0; p < PIXELS; p++) {
            const double now = misfit(&j, p, j.maps + p * C), e = misfit(&j, p, best + p * C);
            const bool better = !memcmp(best + p * C, j.maps + p * C, C * sizeof *best);
            CHECK(fabs((double)least[p] - e) < 1e-3 * (e + 1), "pixel %d: misfit %g, not %g", p, (double)least[p], e);
            CHECK(!search.begun || least[p] <= before[p], "pixel %d: misfit %g after %g", p, (double)least[p],
                  (double)before[p]);
            CHECK(better || !memcmp(best + p * C, kept + p * C, C * sizeof *best), "pixel %d: best was never tried", p);
            CHECK(better || now > e * (1 - 1e-3), "pixel %d: %g was better than %g", p, now, e);
            for (int i = 0; i < C; i++) {
                const int at = p * C + i;
                const float want = better ? rd_step_length(VIEWS, t) * whole[at]
                                          : (1 - TS_SEARCH_BACK) * (best[at] - j.maps[at]);
                CHECK(fabsf(j.step[at] - want) < 1e-5f, "pixel %d, value %d: a step of %g, not %g", p, i,
                      (double)j.step[at], (double)want);
                j.maps[at] += j.step[at];
                kept[at] = best[at];
            }
            better ? on++ : back++;
            before[p] = least[p];
            if (t == 0) first += e;
            last += t == STEPS - 1 ? e : 0;
        }
        free(whole);
        search.begun = true;
    }
    CHECK(on > 10 * PIXELS && back > PIXELS / 4, "%d steps on and %d back say nothing", on, back);
    CHECK(last < 0.2 * first && last < 0.9 * without_search(91),
          "the misfit fell from %g to %g, without a search to %g", first, last, without_search(91));
    free(best), free(least), free(before), free(kept);
    end(&j);
}

/* All pixels face away from some lights: what the photographs show there counts, whatever a pixel's neighbours are. */
TEST(search_counts_what_faces_away_from_the_light)
{
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        job j = careful(93);
        float *best = floats(PIXELS * C), *least = floats(PIXELS);
        const rd_search search = {best, least, false};
        int dark = 0;
        for (int p = 0; p < PIXELS; p++) j.maps[p * C + MAP_NORMAL] = 0.99f, j.maps[p * C + MAP_NORMAL + 1] = 0;
        step(&j, 1, &search);
        for (int p = 0; p < PIXELS; p++) {
            const double e = misfit(&j, p, j.maps + p * C), x = (p % SIDE + 0.5) / SIDE - 0.5;
            for (int k = 0; k < VIEWS; k++) dark += 0.99 * ((double)j.views[k].light[0] - x) + 0.15 < 0;
            CHECK(fabs((double)least[p] - e) < 1e-3 * (e + 1), "%s, pixel %d: misfit %g, not %g",
                  ts_isa_name((ts_isa)isa), p, (double)least[p], e);
        }
        CHECK(dark > PIXELS, "%d times no light says nothing", dark);
        free(best), free(least);
        end(&j);
    }
}

/* What has a misfit that is no number is never kept, and no step leads there. */
TEST(search_leaves_what_is_not_a_number)
{
    job j = begin(92, VIEWS);
    float *best = floats(PIXELS * C), *least = floats(PIXELS);
    rd_search search = {best, least, false};
    step(&j, 1, &search);
    search.begun = true;
    float kept[C];
    memcpy(kept, best, sizeof kept);
    const float fit = least[0];
    for (int i = 0; i < C; i++) j.maps[i] = kept[i] + 0.1f;
    j.image[0][0] = NAN;
    step(&j, 1, &search);
    CHECK(!memcmp(best, kept, sizeof kept) && least[0] == fit, "maps without a misfit were kept");
    for (int i = 0; i < C; i++) CHECK(isfinite(j.step[i]), "channel %d goes by %g", i, (double)j.step[i]);
    free(best), free(least);
    end(&j);
}

/* Of one photograph of glossy maps under a near flash: the mean misfit after some steps, and how far maps end
 * from others that began 1e-6 away. */
static double settled(bool whole, int steps, double *apart)
{
    double sum = 0;
    float *ends[2];
    for (int k = 0; k < 2; k++) {
        job j = begin(94, 1);
        j.scale = (ts_prior){{0.1f, 0.1f}, 0.1f, 0.002f, 0.5f, 0.5f};
        for (int i = 0; i < PIXELS * C; i++) { /* the truth is a deviation away from glossy maps, which are the mean */
            const bool normal = i % C == MAP_NORMAL || i % C == MAP_NORMAL + 1;
            j.mean[i] = i % C == MAP_ROUGHNESS ? -0.75f : normal ? 0.2f * j.maps[i] : j.maps[i];
            j.truth[i] = j.mean[i] + 0.2f * (j.truth[i] > 0 ? 1 : -1) * j.deviation[i / C * G + group_of[i % C]];
            j.maps[i] = j.mean[i] + (k ? 1e-6f : 0);
        }
        rd_render(rd_grid_full(SIDE), j.truth, C, j.views, true, j.image[0]);
        for (int t = 0; t < steps; t++) {
            step(&j, whole ? 1 : rd_step_length(1, t), NULL);
            for (int i = 0; i < PIXELS * C; i++) j.maps[i] += j.step[i];
        }
        for (int p = 0; p < PIXELS && !k; p++) sum += misfit(&j, p, j.maps + p * C) / PIXELS;
        ends[k] = floats(PIXELS * C);
        memcpy(ends[k], j.maps, PIXELS * C * sizeof *ends[k]);
        end(&j);
    }
    *apart = 0;
    for (int i = 0; i < PIXELS * C; i++) *apart = farther(*apart, fabs((double)ends[0][i] - (double)ends[1][i]));
    free(ends[0]), free(ends[1]);
    return sum;
}

/* Whole steps on glossy pixels swing; shortened ones come to rest at maps that fit better, and where they end does not
 * hang on the last digits of where they begin. */
TEST(steps_of_one_photograph_come_to_rest)
{
    double apart, far;
    for (int steps = 4; steps <= 8; steps += 2) {
        const double whole = settled(true, steps, &far), shortened = settled(false, steps, &apart);
        printf("  %d steps: misfit %.4g, apart %.2g; whole ones: %.4g, %.2g\n", steps, shortened, apart, whole, far);
        CHECK(shortened < 0.9 * whole, "%d steps: misfit %g, with whole ones %g", steps, shortened, whole);
        CHECK(apart < 5e-4, "%d steps end %g apart", steps, apart);
    }
}
