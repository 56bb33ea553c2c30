/* mean: one constant material, the floor that everything must beat. */
#include "eval/methods/method_internal.h"
#include "render/render.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void mean_colour(const float *image, int64_t pixels, double mean[3])
{
    for (int k = 0; k < 3; k++) mean[k] = 0;
    for (int64_t i = 0; i < pixels; i++)
        for (int k = 0; k < 3; k++) mean[k] += (double)image[i * 3 + k] / (double)pixels;
}

/* Scales the diffuse so that the mean of the re-rendering, which is linear in it, is the photograph's. */
static ts_code fit(const ev_case *c, float mean[MAP_CHANNELS], float *maps, ts_status *st)
{
    const int64_t pixels = (int64_t)c->size * c->size;
    float *image = malloc((size_t)pixels * 3 * sizeof *image), black[MAP_CHANNELS];
    double photo[3], all[3], specular[3];
    if (!image) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", c->size, c->size);
    mean_colour(c->image, pixels, photo);
    memcpy(black, mean, sizeof black);
    for (int k = 0; k < 3; k++) black[MAP_DIFFUSE + k] = -1;
    for (int pass = 0; pass < 2; pass++) {
        ev_fill(c, pass ? black : mean, maps);
        rd_render(rd_grid_full(c->size), maps, MAP_CHANNELS, &c->view, false, image);
        mean_colour(image, pixels, pass ? specular : all);
    }
    for (int k = 0; k < 3; k++) {
        const double diffuse = all[k] - specular[k], value = (double)(mean[MAP_DIFFUSE + k] + 1) / 2;
        if (diffuse > 0)
            mean[MAP_DIFFUSE + k] = (float)(2 * fmin(fmax(value * (photo[k] - specular[k]) / diffuse, 0), 1) - 1);
    }
    free(image);
    return TS_OK;
}

/* A flat matt material of the photograph's mean colour. */
static void photo_colour(const ev_case *c, float mean[MAP_CHANNELS])
{
    const io_texel plain = {.normal = {0, 0, 1}, .roughness = 0.5f, .specular = {0.04f, 0.04f, 0.04f}};
    double colour[3];
    mean_colour(c->image, (int64_t)c->size * c->size, colour);
    io_texel_put(mean, &plain);
    for (int k = 0; k < 3; k++) mean[MAP_DIFFUSE + k] = (float)(2 * fmin(colour[k], 1) - 1);
}

enum { FIT_NO, FIT_YES, FIT_COLOUR };

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    float mean[MAP_CHANNELS];
    ts_code code = ev_mean(mean, st);
    if (!code) code = ev_block(e, (size_t)c->size * (size_t)c->size * MAP_CHANNELS, st);
    const int how = (int)ev_number(e, "fit");
    if (how == FIT_COLOUR) photo_colour(c, mean);
    if (!code && how == FIT_YES) code = fit(c, mean, e->x, st);
    if (code) return code;
    ev_fill(c, mean, e->x);
    seen(0, e->x, MAP_CHANNELS, user);
    return TS_OK;
}

static const ev_setting settings[] = {
    {.key = "fit",
     .type = EV_WORD,
     .words = "no yes colour",
     .initial = "yes",
     .grid = "no yes",
     .help = "scale its diffuse so that the re-rendering is as bright as the photograph; or of the photograph's mean "
             "colour, flat, F0 0.04, roughness 0.5"},
    {0}};
const ev_method ev_method_mean = {
    .name = "mean", .help = "the mean of procedural materials, the same everywhere", .settings = settings, .run = run};
