#include "eval/metrics/metrics.h"
#include "data/camera.h"
#include "eval/metrics/flip.h"
#include "eval/metrics/residue.h"
#include "eval/metrics/ssim.h"
#include "eval/multiview.h"
#include "render/error.h"
#include "render/render.h"
#include "render/tone.h"
#include <math.h>
#include <stdlib.h>

const char *const ev_metric_name[EV_METRICS] = {"diffuse",
                                                "specular",
                                                "roughness",
                                                "normal",
                                                "render",
                                                "angle",
                                                "ssim",
                                                "flip",
                                                "exposure",
                                                "lpips",
                                                "flat",
                                                "over_flat",
                                                "band_2_8",
                                                "band_8_32",
                                                "band_32_64",
                                                "band_64_128",
                                                "residue_diffuse",
                                                "residue_specular",
                                                "residue_roughness",
                                                "residue_hue",
                                                "relief"};

void ev_photograph(const io_material *truth, const ev_photo *photo, float *image)
{
    rd_view view = photo->view;
    view.power *= (float)photo->exposure;
    rd_render(rd_grid_full(truth->size), truth->maps, MAP_CHANNELS, &view, true, image);
    const io_camera camera = {.noise = photo->noise, .quantise = true};
    if (photo->noise > 0) io_camera_apply(&camera, photo->seed, photo->identity, truth->size, image);
}

void ev_input_views(const rd_view *given, int count, uint64_t seed, uint64_t identity, rd_view *input)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_CAPTURE, identity);
    rd_capture_draw(&rng, count, input);
    input[0] = *given; /* instead of the flash */
}

bool ev_perceived(int size, bool perceptual, bool lpips, const double value[EV_METRICS])
{
    return !(perceptual && isnan(value[EV_FLIP])) && !(perceptual && size >= EV_SSIM_SIDE && isnan(value[EV_SSIM])) &&
        !(lpips && size >= EV_LPIPS_SIDE && isnan(value[EV_LPIPS]));
}

/* SSIM and LPIPS as RMSE in gamma space; FLIP takes linear values. Where a factor is fitted the estimate has it. */
static void perceive(const ev_case *c, const float *maps, int channels, ev_row *row)
{
    const int size = c->truth->size;
    const size_t values = (size_t)size * (size_t)size * 3;
    float *mine = malloc(2 * values * sizeof *mine), *truth = mine ? mine + values : NULL;
    double ssim = mine && c->perceptual ? 0 : NAN, flip = ssim, lpips = mine && c->lpips ? 0 : NAN;
    for (int v = 0; v < RD_EVAL_VIEWS && mine; v++) {
        rd_view view = c->views[v];
        if (c->fit) view.power *= (float)row->value[EV_EXPOSURE];
        rd_render(rd_grid_full(size), maps, channels, &view, true, mine);
        rd_render(rd_grid_full(size), c->truth->maps, MAP_CHANNELS, &c->views[v], true, truth);
        if (c->perceptual) flip += ev_flip(size, size, mine, truth, NULL) / RD_EVAL_VIEWS;
        for (size_t i = 0; i < 2 * values; i++) mine[i] = rd_gamma(mine[i]);
        if (c->perceptual) ssim += ev_ssim(size, size, mine, truth) / RD_EVAL_VIEWS;
        if (c->lpips) lpips += ev_lpips_distance(c->lpips, size, size, mine, truth, NULL) / RD_EVAL_VIEWS;
    }
    row->value[EV_SSIM] = ssim;
    row->value[EV_FLIP] = flip;
    row->value[EV_LPIPS] = lpips;
    if (!ev_perceived(size, c->perceptual, c->lpips, row->value)) row->value[EV_RENDER] = NAN;
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

ev_case ev_case_of_photo(const float *image, int size)
{
    const rd_view flash = rd_flash();
    return (ev_case){.size = size, .view = flash, .image = image, .inputs = 1, .input = {flash}, .exposure = 1};
}

ev_case ev_case_of_capture(const io_capture *capture, const float *image, int inputs, bool light_known, bool perceptual)
{
    ev_case c = {.size = capture->size,
                 .view = light_known ? ev_capture_view(capture, 0) : rd_flash(),
                 .image = image,
                 .inputs = inputs,
                 .exposure = 1,
                 .fov = rd_fov_from(capture->camera[0]),
                 .capture = capture,
                 .perceptual = perceptual};
    for (int i = 0; i < inputs; i++) c.input[i] = light_known ? ev_capture_view(capture, i) : rd_flash();
    return c;
}

typedef struct factor {
    double products, squares;
} factor;

/* encoded: room for 2 x values. */
static void factor_add(factor *f, size_t values, const float *mine, const float *truth, float *encoded)
{
    rd_gamma_encode((int64_t)values, mine, encoded);
    rd_gamma_encode((int64_t)values, truth, encoded + values);
    for (size_t i = 0; i < values; i++) {
        if (mine[i] > 1 || truth[i] > 1) continue;
        const double a = (double)encoded[i], b = (double)encoded[values + i];
        f->products += a * b;
        f->squares += a * a;
    }
}

static double factor_of(const factor *f) { return f->products > 0 ? pow(f->products / f->squares, 2.2) : 1; }

double ev_factor(size_t values, const float *a, const float *b)
{
    factor f = {0};
    float *encoded = malloc(2 * values * sizeof *encoded);
    if (encoded) factor_add(&f, values, a, b, encoded);
    free(encoded);
    return factor_of(&f);
}

/* That of all renderings together. */
static double fitted_exposure(const ev_case *c, const float *maps, int channels, float *mine, float *truth,
                              float *encoded)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    factor f = {0};
    for (int v = 0; v < RD_EVAL_VIEWS; v++) {
        rd_render(rd_grid_full(c->size), maps, channels, &c->views[v], false, mine);
        rd_render(rd_grid_full(c->size), c->truth->maps, MAP_CHANNELS, &c->views[v], false, truth);
        factor_add(&f, values, mine, truth, encoded);
    }
    return factor_of(&f);
}

/* EV_RENDER with that factor on the estimate. */
static void fit(const ev_case *c, const float *maps, int channels, ev_row *row)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    float *mine = malloc(4 * values * sizeof *mine), *truth = mine + values;
    row->value[EV_RENDER] = NAN;
    if (!mine) return;
    const double exposure = fitted_exposure(c, maps, channels, mine, truth, truth + values);
    double rmse = 0;
    for (int v = 0; v < RD_EVAL_VIEWS; v++) {
        rd_view view = c->views[v];
        rd_render(rd_grid_full(c->size), c->truth->maps, MAP_CHANNELS, &view, true, truth);
        view.power *= (float)exposure;
        rd_render(rd_grid_full(c->size), maps, channels, &view, true, mine);
        rd_gamma_encode(2 * (int64_t)values, mine, mine);
        double sum = 0;
        for (size_t i = 0; i < values; i++) {
            const double d = (double)mine[i] - (double)truth[i];
            sum += d * d;
        }
        rmse += sqrt(sum / (double)values) / RD_EVAL_VIEWS;
    }
    row->value[EV_RENDER] = rmse;
    row->value[EV_EXPOSURE] = exposure;
    free(mine);
}

static ev_row score_photo(const ev_case *c, const float *maps, int channels)
{
    const ev_residue r = ev_residue_of(c->size, maps, channels);
    ev_row row;
    for (int k = 0; k < EV_METRICS; k++) row.value[k] = NAN;
    row.value[EV_RESIDUE_DIFFUSE] = r.diffuse;
    row.value[EV_RESIDUE_SPECULAR] = r.specular;
    row.value[EV_RESIDUE_ROUGHNESS] = r.roughness;
    row.value[EV_RESIDUE_HUE] = r.hue;
    row.value[EV_RELIEF] = r.relief;
    return row;
}

/* Those that compare normals alone. False: there is no memory. */
static bool score_normals(const io_material *truth, const float *maps, int channels, ev_row *row)
{
    const float flat[MAP_CHANNELS] = {0};
    const int64_t pixels = (int64_t)truth->size * truth->size;
    double squares = 0;
    for (int64_t i = 0; i < pixels; i++) {
        const double e = rd_map_rmse(1, flat, MAP_CHANNELS, truth->maps + i * MAP_CHANNELS, MAP_CHANNELS).normal;
        squares += e * e / (double)pixels;
    }
    row->value[EV_FLAT] = sqrt(squares);
    row->value[EV_OVER_FLAT] = sqrt(squares) > EV_LEAST_RELIEF ? row->value[EV_NORMAL] / sqrt(squares) : NAN;
    return ev_band_correlation(truth->size, maps, channels, truth->maps, MAP_CHANNELS, row->value + EV_BAND);
}

ev_row ev_score(const ev_case *c, const float *maps, int channels)
{
    if (c->capture) return ev_capture_score(c->capture, c->inputs, maps, channels, c->perceptual, c->lpips);
    if (!c->truth) return score_photo(c, maps, channels);
    const io_material *truth = c->truth;
    const rd_map_error e = rd_map_rmse((int64_t)truth->size * truth->size, maps, channels, truth->maps, MAP_CHANNELS);
    ev_row row;
    for (int k = 0; k < EV_METRICS; k++) row.value[k] = NAN;
    row.value[EV_DIFFUSE] = e.diffuse;
    row.value[EV_SPECULAR] = e.specular;
    row.value[EV_ROUGHNESS] = e.roughness;
    row.value[EV_NORMAL] = e.normal;
    row.value[EV_ANGLE] = e.angle;
    const bool measured = score_normals(truth, maps, channels, &row);
    if (c->fit) fit(c, maps, channels, &row);
    else
        row.value[EV_RENDER] = rd_render_rmse(rd_grid_full(truth->size), maps, channels, truth->maps, MAP_CHANNELS,
                                              c->views, RD_EVAL_VIEWS);
    if (c->perceptual || c->lpips) perceive(c, maps, channels, &row);
    if (!measured || row.value[EV_RENDER] < 0) row.value[EV_RENDER] = NAN; /* no memory: the caller says so */
    return row;
}
