#include "nn/metal.h"
#include "nn/kind.h"
#include "render/posterior.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The pixels of maps and photographs that are looked at. */
typedef struct sample {
    rd_grid grid;
    float *r0, *deviation, *image[NN_MAX_IMAGES];
    float *maps, *step, *best, *misfit, *memory;
} sample;

static void take(rd_grid from, const nn_metal_photos *p, const float *r0, int channels, const float *deviation,
                 sample *s)
{
    const int side = s->grid.side;
    for (int i = 0; i < side * side; i++) {
        const double x = (i % side + 0.5) / side, y = (i / side + 0.5) / side;
        const size_t map = (size_t)(y * from.side) * (size_t)from.side + (size_t)(x * from.side),
                     photo = (size_t)(y * p->side) * (size_t)p->side + (size_t)(x * p->side);
        memcpy(s->r0 + (size_t)(i * channels), r0 + map * (size_t)channels, (size_t)channels * sizeof *r0);
        memcpy(s->deviation + (size_t)(i * NN_SPREADS), deviation + map * NN_SPREADS, NN_SPREADS * sizeof *deviation);
        for (int k = 0; k < p->given; k++)
            for (int c = 0; c < 3; c++) s->image[k][i * 3 + c] = fminf(fmaxf(p->image[k][photo * 3 + (size_t)c], 0), 1);
    }
}

/* The mean of log(1 + E) after the steps from maps as they are read, or of the other kind. */
static double misfit(const nn_metal_photos *p, bool other, bool metal, int steps, int channels, sample *s)
{
    const int pixels = s->grid.side * s->grid.side, values = pixels * channels;
    float *mean = s->memory;
    memcpy(mean, s->r0, (size_t)values * sizeof *mean);
    if (other) nn_change_kind(metal, pixels, channels, mean);
    const rd_prior prior = {mean, s->deviation, nn_step_prior(p->known, p->given)};
    const int and_a_look = steps + 1; /* at what the last one made */
    rd_posterior_steps(s->grid, channels, p->views, (const float *const *)s->image, p->given, &prior, and_a_look,
                       (rd_search){.best = s->best, .misfit = s->misfit}, s->maps, s->step, NULL);
    double sum = 0;
    for (int i = 0; i < pixels; i++) sum += log1p((double)s->misfit[i]);
    return sum / pixels;
}

static bool sample_create(rd_grid grid, int given, int channels, sample *s)
{
    const size_t pixels = (size_t)grid.side * (size_t)grid.side, maps = pixels * (size_t)channels;
    *s = (sample){.grid = grid};
    float *at = s->memory = malloc((4 * maps + pixels * (NN_SPREADS + MAP_CHANNELS + 1 + 3 * (size_t)given)) *
                                   sizeof *at);
    if (!at) return false;
    s->r0 = at += maps; /* the prior's mean is before it */
    s->maps = at += maps;
    s->step = at += maps;
    s->best = at += maps;
    s->deviation = at += pixels * MAP_CHANNELS;
    s->misfit = at += pixels * NN_SPREADS;
    at += pixels;
    for (int k = 0; k < given; k++) s->image[k] = at + (size_t)k * pixels * 3;
    return true;
}

ts_code nn_tell_metal(rd_grid grid, const nn_metal_photos *photos, const float *deviation, int steps, int channels,
                      float *r0, ts_status *st)
{
    const int side = grid.side < NN_METAL_SIDE ? grid.side : NN_METAL_SIDE;
    sample s;
    if (!sample_create(rd_grid_on(rd_grid_full(side), grid.threads), photos->given, channels, &s))
        return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", side, side);
    take(grid, photos, r0, channels, deviation, &s);
    const bool metal = nn_is_metal((int64_t)side * side, channels, s.r0);
    if (misfit(photos, true, metal, steps, channels, &s) <
        NN_METAL_SURE * misfit(photos, false, metal, steps, channels, &s))
        nn_change_kind(metal, (int64_t)grid.side * grid.side, channels, r0);
    free(s.memory);
    return TS_OK;
}
