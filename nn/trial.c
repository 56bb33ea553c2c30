#include "nn/trial.h"
#include "nn/clip.h"
#include "render/rows.h"
#include "tensor/maps.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void take(rd_grid from, const float *r0, const float *deviation, nn_trial *t)
{
    const nn_photos *p = t->photos;
    const int side = t->side, channels = t->channels;
    for (int i = 0; i < side * side; i++) {
        const int x = i % side, y = i / side,
                  map = rd_middle(y, side, from.side) * from.side + rd_middle(x, side, from.side),
                  photo = rd_middle(y, side, p->side) * p->side + rd_middle(x, side, p->side);
        memcpy(t->r0 + (size_t)(i * channels), r0 + (size_t)map * (size_t)channels, (size_t)channels * sizeof *r0);
        memcpy(t->deviation + (size_t)(i * NN_SPREADS), deviation + (size_t)map * NN_SPREADS,
               NN_SPREADS * sizeof *deviation);
        for (int k = 0; k < p->given; k++) nn_clip(3, p->image[k] + (size_t)photo * 3, t->image[k] + (size_t)i * 3);
    }
}

ts_code nn_trial_begin(rd_grid from, int side, const nn_photos *photos, const float *deviation, int channels,
                       const float *r0, nn_trial *t, ts_status *st)
{
    if (side > from.side) side = from.side;
    const size_t pixels = (size_t)side * (size_t)side, maps = pixels * (size_t)channels,
                 others = NN_SPREADS + MAP_CHANNELS + 1 + 3 * (size_t)photos->given;
    *t = (nn_trial){
        .side = side, .channels = channels, .grid = rd_grid_on(rd_grid_full(side), from.threads), .photos = photos};
    float *at = t->memory = malloc((4 * maps + pixels * others) * sizeof *at);
    if (!at) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", side, side);
    t->tried = at;
    t->r0 = at += maps;
    t->maps = at += maps;
    t->step = at += maps;
    t->best = at += maps;
    t->deviation = at += pixels * MAP_CHANNELS;
    t->misfit = at += pixels * NN_SPREADS;
    at += pixels;
    for (int k = 0; k < photos->given; k++) t->image[k] = at + (size_t)k * pixels * 3;
    take(from, r0, deviation, t);
    return TS_OK;
}

double nn_trial_misfit(nn_trial *t, const ts_prior *prior, int steps)
{
    const rd_prior mean = {t->tried, t->deviation, *prior};
    const int pixels = t->side * t->side, and_a_look = steps + 1; /* at what the last one made */
    rd_posterior_steps(t->grid, t->channels, t->photos->views, (const float *const *)t->image, t->photos->given, &mean,
                       and_a_look, (rd_search){.best = t->best, .misfit = t->misfit}, t->maps, t->step, NULL);
    double sum = 0;
    for (int i = 0; i < pixels; i++) sum += log1p((double)t->misfit[i]);
    return sum / pixels;
}

void nn_trial_end(nn_trial *t) { free(t->memory); }
