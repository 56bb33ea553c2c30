#include "eval/metrics/metrics.h"
#include "data/camera.h"
#include "eval/metrics/flip.h"
#include "eval/multiview.h"
#include "eval/ssim.h"
#include "render/error.h"
#include "render/render.h"
#include "render/tone.h"
#include <math.h>
#include <stdlib.h>

const char *const ev_metric_name[EV_METRICS] = {"diffuse", "specular", "roughness", "normal",   "render",
                                                "angle",   "ssim",     "flip",      "exposure", "lpips"};

void ev_photograph(const io_material *truth, const ev_photo *photo, float *image)
{
    rd_view view = photo->view;
    view.power *= (float)photo->exposure;
    rd_render(rd_grid_full(truth->size), truth->maps, MAP_CHANNELS, &view, true, image);
    const io_camera camera = {.noise = photo->noise, .quantise = true};
    if (photo->noise > 0) io_camera_apply(&camera, photo->seed, photo->identity, truth->size, image);
}

void ev_input_views(const rd_view *told, int count, uint64_t seed, uint64_t identity, rd_view *input)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_CAPTURE, identity);
    rd_capture_draw(&rng, count, input);
    input[0] = *told; /* instead of the flash */
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
    const rd_view flash = rd_flash();
    return (ev_case){.size = truth->size,
                     .view = flash,
                     .image = image,
                     .inputs = 1,
                     .input = {flash},
                     .exposure = 1,
                     .truth = truth,
                     .views = views,
                     .perceptual = perceptual};
}

ev_case ev_case_of_capture(const io_capture *capture, const float *image, int inputs, bool perceptual)
{
    ev_case c = {.size = capture->size,
                 .view = ev_capture_view(capture, 0),
                 .image = image,
                 .inputs = inputs,
                 .exposure = 1,
                 .capture = capture,
                 .perceptual = perceptual};
    for (int i = 0; i < inputs; i++) c.input[i] = ev_capture_view(capture, i);
    return c;
}

/* The factor c of least sum of (gamma(c a) - gamma(b))^2 over the values of all renderings that are not clipped:
 * gamma(c a) = c^(1/2.2) gamma(a). */
static double fitted_exposure(const ev_case *c, const float *maps, int channels, float *mine, float *truth)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    double products = 0, squares = 0;
    for (int v = 0; v < RD_EVAL_VIEWS; v++) {
        rd_render(rd_grid_full(c->size), maps, channels, &c->views[v], false, mine);
        rd_render(rd_grid_full(c->size), c->truth->maps, MAP_CHANNELS, &c->views[v], false, truth);
        for (size_t i = 0; i < values; i++) {
            if (mine[i] > 1 || truth[i] > 1) continue;
            const double a = (double)rd_gamma(mine[i]), b = (double)rd_gamma(truth[i]);
            products += a * b;
            squares += a * a;
        }
    }
    return products > 0 ? pow(products / squares, 2.2) : 1;
}

/* EV_RENDER with that factor on the estimate. */
static void fit(const ev_case *c, const float *maps, int channels, ev_row *row)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    float *mine = malloc(2 * values * sizeof *mine), *truth = mine + values;
    row->value[EV_RENDER] = NAN;
    if (!mine) return;
    const double exposure = fitted_exposure(c, maps, channels, mine, truth);
    double rmse = 0;
    for (int v = 0; v < RD_EVAL_VIEWS; v++) {
        rd_view view = c->views[v];
        rd_render(rd_grid_full(c->size), c->truth->maps, MAP_CHANNELS, &view, true, truth);
        view.power *= (float)exposure;
        rd_render(rd_grid_full(c->size), maps, channels, &view, true, mine);
        double sum = 0;
        for (size_t i = 0; i < values; i++) {
            const double d = (double)rd_gamma(mine[i]) - (double)rd_gamma(truth[i]);
            sum += d * d;
        }
        rmse += sqrt(sum / (double)values) / RD_EVAL_VIEWS;
    }
    row->value[EV_RENDER] = rmse;
    row->value[EV_EXPOSURE] = exposure;
    free(mine);
}

ev_row ev_score(const ev_case *c, const float *maps, int channels)
{
    if (c->capture) return ev_capture_score(c->capture, c->inputs, maps, channels, c->perceptual, c->lpips);
    const io_material *truth = c->truth;
    const rd_map_error e = rd_map_rmse((int64_t)truth->size * truth->size, maps, channels, truth->maps, MAP_CHANNELS);
    ev_row row = {{[EV_DIFFUSE] = e.diffuse,
                   [EV_SPECULAR] = e.specular,
                   [EV_ROUGHNESS] = e.roughness,
                   [EV_NORMAL] = e.normal,
                   [EV_ANGLE] = e.angle,
                   [EV_SSIM] = NAN,
                   [EV_FLIP] = NAN,
                   [EV_EXPOSURE] = NAN,
                   [EV_LPIPS] = NAN}};
    if (c->fit) fit(c, maps, channels, &row);
    else
        row.value[EV_RENDER] = rd_render_rmse(rd_grid_full(truth->size), maps, channels, truth->maps, MAP_CHANNELS,
                                              c->views, RD_EVAL_VIEWS);
    if (c->perceptual || c->lpips) perceive(c, maps, channels, &row);
    return row;
}
