#include "eval/metrics.h"
#include "data/camera.h"
#include "eval/flip.h"
#include "eval/multiview.h"
#include "eval/ssim.h"
#include "render/error.h"
#include "render/render.h"
#include "render/tone.h"
#include <math.h>
#include <stdlib.h>

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
