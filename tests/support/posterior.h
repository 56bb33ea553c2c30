/* Photographs of random maps, and a step to the most probable ones: what the tests of render/posterior.h share. */
#ifndef TESTS_POSTERIOR_H
#define TESTS_POSTERIOR_H
#include "render/posterior.h"
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

static inline job begin(uint64_t seed, int count)
{
    job j = {.truth = floats(PIXELS * C),
             .maps = floats(PIXELS * C),
             .mean = floats(PIXELS * C),
             .deviation = floats(PIXELS * G),
             .step = floats(PIXELS * C),
             .after = floats(PIXELS * G),
             .count = count,
             .scale = {{0.2f, 0.1f}, 0.1f, 0.5f, 0.3f, 0.5f}};
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

/* W of a pixel's three values from first on; the result is their encoded root mean square. */
static inline double tint_of(const float *mean, int first, double w[3])
{
    double squares = 0;
    for (int c = 0; c < 3; c++) {
        w[c] = fmin(fmax(((double)mean[first + c] + 1) / 2, 0), 1) + (double)TS_PRIOR_BLACK;
        squares += w[c] * w[c];
    }
    for (int c = 0; c < 3; c++) w[c] /= sqrt(squares / 3);
    return 2 * sqrt(squares / 3);
}

static inline void end(job *j)
{
    for (int k = 0; k < j->count; k++) free(j->image[k]);
    free(j->truth), free(j->maps), free(j->mean), free(j->deviation), free(j->step), free(j->after);
}

static inline void run(job *j)
{
    const rd_prior prior = {j->mean, j->deviation, j->scale};
    rd_posterior_step(rd_grid_full(SIDE), j->maps, C, j->views, (const float *const *)j->image, j->count, &prior, 1,
                      NULL, j->step, j->after);
}
#endif
