#include "render/posterior.h"
#include "render/brdf.h"
#include "render/rows.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

typedef struct step_job {
    rd_grid grid;
    const float *maps, *const *image;
    int channels, count;
    const ts_shade_view *view;
    const rd_prior *prior;
    const rd_search *search;
    float length, *step, *after;
} step_job;

float rd_step_length(int photographs, int steps)
{
    if (photographs == 1) return steps == 0 ? 1 : RD_STEP_LATER;
    return fminf(RD_SEARCH_FIRST * powf(RD_SEARCH_GROWTH, (float)steps), RD_SEARCH_LONGEST);
}

static void step_rows(const void *job, int64_t begin, int64_t end)
{
    const step_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const int64_t at = y * j->grid.w;
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        const float *part[RD_CAPTURE_VIEWS];
        ts_search search;
        if (j->search)
            search = (ts_search){j->search->best + at * MAP_CHANNELS, j->search->misfit + at, j->search->begun};
        for (int k = 0; k < j->count; k++) part[k] = j->image[k] + at * 3;
        ts_posterior_k()->step(j->view, part, j->count, &row, &j->prior->scale, j->prior->mean + at * j->channels,
                               j->prior->deviation + at * MAP_GROUPS, j->length, j->search ? &search : NULL,
                               j->step + at * j->channels, j->after ? j->after + at * MAP_GROUPS : NULL);
    }
}

void rd_posterior_step(rd_grid grid, const float *maps, int channels, const rd_view *views, const float *const *image,
                       int count, const rd_prior *prior, float length, const rd_search *search, float *step,
                       float *after)
{
    ts_shade_view v[RD_CAPTURE_VIEWS];
    for (int k = 0; k < count; k++) v[k] = rd_shade_view(&views[k]);
    ts_for(grid.threads, grid.h, 1, step_rows,
           &(step_job){grid, maps, image, channels, count, v, prior, search, length, step, after});
}

typedef struct sum_job {
    int channels;
    const float *step;
    float *maps;
} sum_job;

static void add_step(const void *job, int64_t begin, int64_t end)
{
    const sum_job *j = job;
    for (int64_t i = begin * j->channels; i < end * j->channels; i += j->channels)
        for (int k = 0; k < MAP_CHANNELS; k++) j->maps[i + k] += j->step[i + k];
}

enum { PIXELS = 1 << 9 }; /* at a time, at least */

void rd_posterior_steps(rd_grid grid, int channels, const rd_view *views, const float *const *image, int count,
                        const rd_prior *prior, int steps, rd_search search, float *maps, float *step, float *after)
{
    const int64_t pixels = (int64_t)grid.h * grid.w;
    memcpy(maps, prior->mean, (size_t)(pixels * channels) * sizeof *maps);
    for (int t = 0; t < steps; t++) {
        search.begun = t > 0;
        rd_posterior_step(grid, maps, channels, views, image, count, prior, rd_step_length(count, t),
                          count > 1 ? &search : NULL, step, t == steps - 1 ? after : NULL);
        ts_for(grid.threads, pixels, PIXELS, add_step, &(sum_job){channels, step, maps});
    }
}

/* W of the three values from at on; the result is their root mean square. */
static double tint(const double mean[MAP_CHANNELS], int at, double w[3])
{
    double squares = 0;
    for (int c = 0; c < 3; c++) {
        w[c] = fmin(fmax((mean[at + c] + 1) / 2, 0), 1) + (double)TS_PRIOR_BLACK;
        squares += w[c] * w[c] / 3;
    }
    for (int c = 0; c < 3; c++) w[c] /= sqrt(squares);
    return sqrt(squares);
}

void rd_prior_covariance(const double deviation[MAP_GROUPS], const double mean[MAP_CHANNELS], const ts_prior *prior,
                         double covariance[MAP_CHANNELS][MAP_CHANNELS])
{
    for (int i = 0; i < MAP_CHANNELS; i++)
        for (int j = 0; j < MAP_CHANNELS; j++) covariance[i][j] = 0;
    for (int k = 0; k < 2; k++) {
        const int at = k ? MAP_SPECULAR : MAP_DIFFUSE;
        double w[3];
        const double widest = 2 * (double)prior->share * tint(mean, at, w);
        double s = deviation[k ? GROUP_SPECULAR : GROUP_DIFFUSE];
        if (prior->share > 0) s = fmin(s, widest);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                covariance[at + a][at + b] = s * s * w[a] * w[b] * (a == b ? 1 : 1 - (double)prior->hue[k]);
    }
    for (int i = 0; i < 2; i++)
        covariance[MAP_NORMAL + i][MAP_NORMAL + i] = deviation[GROUP_NORMAL] * deviation[GROUP_NORMAL];
    covariance[MAP_ROUGHNESS][MAP_ROUGHNESS] = deviation[GROUP_ROUGHNESS] * deviation[GROUP_ROUGHNESS];
}

void rd_observe(const double maps[MAP_CHANNELS], const double point[2], const rd_view *view, const float image[3],
                const ts_prior *prior, rd_observation observation[3])
{
    double value[3], by[3][MAP_CHANNELS];
    rd_radiance(maps, point, view, value, by);
    for (int c = 0; c < 3; c++) {
        rd_observation *o = &observation[c];
        const double target = (double)image[c], positive = fmax(target, 0), model = (double)prior->model,
                     gain = (double)prior->gain * positive;
        const double fade = (double)TS_PRIOR_FADE,
                     confidence = value[c] > 1 && image[c] >= TS_NEWTON_BURNT ? fmax((1 + fade - value[c]) / fade, 0)
                                                                              : 1;
        o->residual = confidence * (target - (value[c] > 1 ? 1 + log(value[c]) : value[c]));
        o->variance = model * model + (double)prior->noise * positive + gain * gain;
        for (int i = 0; i < MAP_CHANNELS; i++) o->by[i] = confidence * by[c][i] / fmax(value[c], 1);
    }
}

void rd_posterior_pixel(const double maps[MAP_CHANNELS], const double point[2], const rd_view *views,
                        const float (*image)[3], int count, const ts_prior *prior, double mean[MAP_CHANNELS],
                        double covariance[MAP_CHANNELS][MAP_CHANNELS])
{
    double at[MAP_CHANNELS];
    for (int i = 0; i < MAP_CHANNELS; i++) at[i] = fmin(fmax(maps[i], -1), 1);
    for (int k = 0; k < 3 * count; k++) {
        rd_observation all[3], *o = &all[k % 3];
        double across[MAP_CHANNELS], total, error;
        rd_observe(at, point, &views[k / 3], image[k / 3], prior, all);
        total = o->variance, error = o->residual;
        for (int i = 0; i < MAP_CHANNELS; i++) {
            across[i] = 0;
            for (int j = 0; j < MAP_CHANNELS; j++) across[i] += covariance[i][j] * o->by[j];
        }
        for (int i = 0; i < MAP_CHANNELS; i++) {
            total += o->by[i] * across[i];
            error -= o->by[i] * (mean[i] - at[i]);
        }
        for (int i = 0; i < MAP_CHANNELS; i++) {
            mean[i] += across[i] * error / total;
            for (int j = 0; j < MAP_CHANNELS; j++) covariance[i][j] -= across[i] * across[j] / total;
        }
    }
}
