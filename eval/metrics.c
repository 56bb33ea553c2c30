#include "eval/metrics.h"
#include "cli/cli.h"
#include "data/camera.h"
#include "eval/flip.h"
#include "eval/multiview.h"
#include "eval/ssim.h"
#include "render/error.h"
#include "render/render.h"
#include "render/tone.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const ev_metric_name[EV_METRICS] = {"diffuse", "specular", "roughness", "normal", "render", "angle", "ssim", "flip", "exposure", "lpips"};

void ev_photograph(const io_material *truth, float noise, uint64_t seed, uint64_t identity, float *image)
{
    const rd_view flash = rd_flash();
    rd_render(rd_grid_full(truth->size), truth->maps, MAP_CHANNELS, &flash, true, image);
    const io_camera camera = {.noise = noise, .quantise = true};
    if (noise > 0) io_camera_apply(&camera, seed, identity, truth->size, image);
}

/* SSIM and LPIPS as RMSE in gamma space; FLIP takes linear values. */
static void perceive(const ev_case *c, const float *maps, int channels, ev_row *row)
{
    const int size = c->truth->size;
    const size_t values = (size_t)size * (size_t)size * 3;
    float *mine = malloc(2 * values * sizeof *mine), *truth = mine ? mine + values : NULL;
    double ssim = mine && c->perceptual ? 0 : NAN, flip = ssim, lpips = mine && c->lpips ? 0 : NAN;
    for (int v = 0; v < RD_EVAL_VIEWS && mine; v++) {
        rd_render(rd_grid_full(size), maps, channels, &c->views[v], true, mine);
        rd_render(rd_grid_full(size), c->truth->maps, MAP_CHANNELS, &c->views[v], true, truth);
        if (c->perceptual) flip += ev_flip(size, size, mine, truth, NULL) / RD_EVAL_VIEWS;
        for (size_t i = 0; i < 2 * values; i++) mine[i] = rd_gamma(mine[i]);
        if (c->perceptual) ssim += ev_ssim(size, size, mine, truth) / RD_EVAL_VIEWS;
        if (c->lpips) lpips += ev_lpips_distance(c->lpips, size, size, mine, truth, NULL) / RD_EVAL_VIEWS;
    }
    row->value[EV_SSIM] = ssim;
    row->value[EV_FLIP] = flip;
    row->value[EV_LPIPS] = lpips;
    free(mine);
}

ev_case ev_case_of_maps(const io_material *truth, const float *image, const rd_view *views, bool perceptual)
{
    return (ev_case){.size = truth->size, .view = rd_flash(), .image = image, .truth = truth, .views = views, .perceptual = perceptual};
}

ev_case ev_case_of_capture(const io_capture *capture, const float *image, bool perceptual)
{
    return (ev_case){.size = capture->size, .view = ev_capture_view(capture, 0), .image = image, .capture = capture, .perceptual = perceptual};
}

ev_row ev_score(const ev_case *c, const float *maps, int channels)
{
    if (c->capture) return ev_capture_score(c->capture, maps, channels, c->perceptual, c->lpips);
    const io_material *truth = c->truth;
    const rd_map_error e = rd_map_rmse((int64_t)truth->size * truth->size, maps, channels, truth->maps, MAP_CHANNELS);
    ev_row row = {{[EV_DIFFUSE] = e.diffuse, [EV_SPECULAR] = e.specular, [EV_ROUGHNESS] = e.roughness, [EV_NORMAL] = e.normal, [EV_ANGLE] = e.angle, [EV_SSIM] = NAN, [EV_FLIP] = NAN, [EV_EXPOSURE] = NAN, [EV_LPIPS] = NAN,
        [EV_RENDER] = rd_render_rmse(rd_grid_full(truth->size), maps, channels, truth->maps, MAP_CHANNELS, c->views, RD_EVAL_VIEWS)}};
    if (c->perceptual || c->lpips) perceive(c, maps, channels, &row);
    return row;
}

typedef struct watch {
    const ev_case *c;
    int steps;
    ev_row *row;
    double *seconds, start, scoring; /* scoring: spent on scores so far */
    float *first, *last;
    bool finite;
} watch;

static bool after_step(int step, const ag_value *maps, void *user)
{
    watch *w = user;
    const double now = cl_seconds();
    if (w->seconds) w->seconds[step] = now - w->start - w->scoring;
    const int size = w->c->size, channels = maps->t.shape.c;
    const int64_t pixels = (int64_t)size * size;
    ev_case c = *w->c;
    c.perceptual = c.perceptual && (step == 0 || step == w->steps);
    if (step != 0 && step != w->steps) c.lpips = NULL;
    w->row[step] = ev_score(&c, maps->t.data, channels);
    w->finite = isfinite(w->row[step].value[EV_RENDER]);
    for (int64_t i = 0; i < pixels * channels; i++) w->finite = w->finite && isfinite(maps->t.data[i]); /* a clamp may hide it from the scores */
    for (int copy = 0; copy < 2; copy++) {
        float *to = copy ? w->last : step == 0 ? w->first : NULL;
        for (int64_t i = 0; to && i < pixels; i++) memcpy(to + i * MAP_CHANNELS, maps->t.data + i * channels, MAP_CHANNELS * sizeof *to);
    }
    w->scoring += cl_seconds() - now;
    return w->finite;
}

ts_code ev_measure(ag_tape *tape, const nn_model *model, const ev_case *c, int steps, ev_row *row, double *seconds, float *first, float *last, ts_status *st)
{
    const int size = c->size;
    ag_reset(tape);
    nn_input in = {.image = ts_new(ag_arena(tape), (ts_shape){1, size, size, 3}), .grid = rd_grid_full(size), .view = c->view};
    if (!in.image.data) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    memcpy(in.image.data, c->image, (size_t)size * (size_t)size * 3 * sizeof *c->image);
    watch w = {c, steps, row, seconds, cl_seconds(), 0, first, last, true};
    ag_value *out = NULL;
    if (nn_lgd(tape, model, &in, steps, false, &out, after_step, &w) != TS_OK) {
        *st = *ag_status(tape);
        return st->code;
    }
    if (!w.finite) return ts_fail(st, TS_NUMERIC, "the maps or their renderings have no finite error: damaged weights, or out of memory");
    return TS_OK;
}
