#include "nn/level.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

enum { ROUNDS = 8 }; /* of the search; after one that finds nothing better it looks half as far */

/* Standard deviations of the levels, and how far the search looks first. */
static const float usual[NN_LEVELS] = {0.35f, 0.35f, 0.4f, 0.1f, 0.15f, 0.15f, 0.1f, 0.1f};
static const float first_stride[NN_LEVELS] = {0.4f, 0.4f, 0.3f, 0.1f, 0.2f, 0.2f, 0.1f, 0.1f};

void nn_set_levels(int64_t pixels, int channels, const float level[NN_LEVELS], float *maps)
{
    const float beneath = level[NN_LEVEL_BENEATH], rough = expf(level[NN_LEVEL_ROUGHNESS]);
    float diffuse[3], f0[3];
    for (int c = 0; c < 3; c++) {
        const bool red = c == 0, blue = c == 2;
        diffuse[c] = expf(level[NN_LEVEL_DIFFUSE] + (float)red * level[NN_LEVEL_DIFFUSE_RED] +
                          (float)blue * level[NN_LEVEL_DIFFUSE_BLUE]);
        f0[c] = expf(level[NN_LEVEL_F0] + (float)red * level[NN_LEVEL_F0_RED] + (float)blue * level[NN_LEVEL_F0_BLUE]);
    }
    for (int64_t i = 0; i < pixels; i++, maps += channels) {
        for (int c = 0; c < 3; c++) {
            float *of = &maps[MAP_DIFFUSE + c], *f = &maps[MAP_SPECULAR + c];
            *of = fminf(fmaxf((*of + 1) * diffuse[c] + beneath * (*f + 1) - 1, -1), 1);
            *f = fminf(fmaxf((*f + 1) * f0[c] - 1, -1), 1);
        }
        maps[MAP_ROUGHNESS] = fminf(fmaxf((maps[MAP_ROUGHNESS] + 1) * rough - 1, -1), 1);
    }
}

static double cost(nn_trial *t, const float level[NN_LEVELS])
{
    const int pixels = t->side * t->side;
    const ts_prior prior = nn_step_prior(t->photos->known, 1);
    memcpy(t->tried, t->r0, (size_t)(pixels * t->channels) * sizeof *t->tried);
    nn_set_levels(pixels, t->channels, level, t->tried);
    double sum = nn_trial_misfit(t, &prior, NN_LEVEL_STEPS);
    for (int k = 0; k < NN_LEVELS; k++) {
        const double far = (double)(level[k] / usual[k]);
        sum += NN_LEVEL_COST * far * far;
    }
    return sum;
}

/* From level along its k-th number, one way or else the other. Whether that is better, and level is there. */
static bool go(nn_trial *t, int k, float stride, float level[NN_LEVELS], double *best)
{
    for (int way = -1; way <= 1; way += 2) {
        const float before = level[k];
        level[k] += (float)way * stride;
        const double there = level[NN_LEVEL_BENEATH] < 0 ? INFINITY : cost(t, level);
        if (there < *best) return *best = there, true;
        level[k] = before;
    }
    return false;
}

/* Of a told kind the map that tells kinds apart is known: a metal's diffuse, a dielectric's F0. */
static bool is_told(nn_kind kind, int k)
{
    const bool diffuse = k == NN_LEVEL_DIFFUSE || k == NN_LEVEL_BENEATH || k == NN_LEVEL_DIFFUSE_RED ||
        k == NN_LEVEL_DIFFUSE_BLUE,
               f0 = k == NN_LEVEL_F0 || k == NN_LEVEL_F0_RED || k == NN_LEVEL_F0_BLUE;
    return kind == NN_KIND_METAL ? diffuse : kind == NN_KIND_DIELECTRIC && f0;
}

ts_code nn_find_levels(rd_grid grid, const float *image, int side, const rd_view *view, nn_kind kind,
                       const float *deviation, int channels, float *r0, ts_status *st)
{
    /* Steps that come with a misfit are those of several photographs: this one is there twice. */
    const float *const twice[] = {image, image};
    const rd_view views[] = {*view, *view};
    const nn_photos photos = {twice, views, 2, side, NN_KNOWN_ALL};
    nn_trial t;
    if (nn_trial_begin(grid, NN_LEVEL_SIDE, &photos, deviation, channels, r0, &t, st)) return st->code;
    float level[NN_LEVELS] = {0}, stride[NN_LEVELS];
    memcpy(stride, first_stride, sizeof stride);
    const double as_read = cost(&t, level);
    double best = as_read;
    for (int round = 0; round < ROUNDS; round++) {
        bool better = false;
        for (int k = 0; k < NN_LEVELS; k++) better |= !is_told(kind, k) && go(&t, k, stride[k], level, &best);
        for (int k = 0; k < NN_LEVELS && !better; k++) stride[k] *= 0.5f;
    }
    nn_trial_end(&t);
    const double believed = fmin((NN_LEVEL_DOUBTFUL - best / as_read) / (NN_LEVEL_DOUBTFUL - NN_LEVEL_SURE), 1);
    for (int k = 0; k < NN_LEVELS; k++) level[k] *= (float)believed;
    if (believed > 0) nn_set_levels((int64_t)grid.side * grid.side, channels, level, r0);
    return TS_OK;
}
