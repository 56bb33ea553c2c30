#include "eval/multiview.h"
#include "eval/metrics/flip.h"
#include "eval/metrics/metrics.h"
#include "eval/metrics/ssim.h"
#include "infer/capture.h"
#include "render/render.h"
#include "render/tone.h"
#include <math.h>
#include <stdlib.h>

static void swap(void *a, void *b, size_t size)
{
    unsigned char *x = a, *y = b;
    for (size_t i = 0; i < size; i++) {
        const unsigned char t = x[i];
        x[i] = y[i], y[i] = t;
    }
}

void ev_capture_nearest_first(io_capture *c)
{
    const size_t bytes = (size_t)c->size * (size_t)c->size * 3 * sizeof *c->image;
    int nearest = 0;
    for (int i = 1; i < c->images; i++) {
        const float *now = c->camera[i], *best = c->camera[nearest];
        if (hypotf(now[0], now[1]) < hypotf(best[0], best[1])) nearest = i;
    }
    for (int i = nearest; i > 0; i--) {
        swap((char *)c->image + (size_t)i * bytes, (char *)c->image + (size_t)(i - 1) * bytes, bytes);
        swap(c->camera[i], c->camera[i - 1], sizeof c->camera[i]);
        swap(c->light[i], c->light[i - 1], sizeof c->light[i]);
    }
}

rd_view ev_capture_view(const io_capture *c, int picture)
{
    rd_view view = {.kind = RD_POINT};
    float gain[3];
    lgd_capture_gain(c, false, gain);
    view.power = c->power[1] * gain[1]; /* the same for every colour */
    for (int k = 0; k < 3; k++) {
        view.camera[k] = c->camera[picture][k];
        view.light[k] = c->light[picture][k];
    }
    return view;
}

void ev_capture_input(const io_capture *c, int inputs, bool as_taken, float *image)
{
    float gain[3];
    lgd_capture_gain(c, as_taken, gain);
    for (size_t i = 0; i < (size_t)inputs * (size_t)c->size * (size_t)c->size * 3; i++)
        image[i] = fminf(c->image[i] * gain[i % 3], 1);
}

/* Linear radiance in the capture's own brightness. */
static void render(const io_capture *c, int picture, const float *maps, int channels, float *image)
{
    const rd_view view = ev_capture_view(c, picture);
    float gain[3];
    lgd_capture_gain(c, false, gain);
    rd_render(rd_grid_full(c->size), maps, channels, &view, false, image);
    for (size_t i = 0; i < (size_t)c->size * (size_t)c->size * 3; i++) image[i] /= gain[i % 3];
}

static void expose(size_t values, double exposure, const float *in, float *out)
{
    for (size_t i = 0; i < values; i++) out[i] = (float)fmin((double)in[i] * exposure, 1);
}

/* photo is gamma-encoded, scene linear. */
static double difference(size_t values, const float *photo, const float *scene, double exposure)
{
    double sum = 0;
    for (size_t i = 0; i < values; i++) {
        const double d = (double)rd_gamma((float)((double)scene[i] * exposure)) - (double)photo[i];
        sum += d * d;
    }
    return sqrt(sum / (double)values);
}

/* The exposure of least difference: the best of a coarse grid of stops, then golden section between its neighbours. A
 * descent would fail far away, where clamping makes the difference constant. */
static double fit(size_t values, const float *photo, const float *scene)
{
    const double golden = 0.6180339887498949;
    double best = 0, least = INFINITY;
    for (int stop = -8; stop <= 8; stop++) {
        const double d = difference(values, photo, scene, exp2(stop));
        if (d < least) least = d, best = stop;
    }
    double lo = best - 1, hi = best + 1;
    double a = hi - golden * (hi - lo), b = lo + golden * (hi - lo);
    double da = difference(values, photo, scene, exp2(a)), db = difference(values, photo, scene, exp2(b));
    while (hi - lo > 1e-4) {
        if (da < db) {
            hi = b, b = a, db = da;
            a = hi - golden * (hi - lo);
            da = difference(values, photo, scene, exp2(a));
        } else {
            lo = a, a = b, da = db;
            b = lo + golden * (hi - lo);
            db = difference(values, photo, scene, exp2(b));
        }
    }
    return exp2((lo + hi) / 2);
}

ev_row ev_capture_score(const io_capture *c, int inputs, const float *maps, int channels, bool perceptual,
                        ev_lpips *lpips)
{
    ev_row row;
    for (int k = 0; k < EV_METRICS; k++) row.value[k] = NAN;
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    float *memory = malloc(3 * values * sizeof *memory), *photo = memory, *scene = memory + values,
          *shown = memory + 2 * values;
    if (!memory || c->images <= inputs) {
        free(memory);
        return row;
    }
    for (size_t i = 0; i < values; i++) photo[i] = rd_gamma(c->image[i]);
    render(c, 0, maps, channels, scene);
    const double exposure = fit(values, photo, scene);
    double rmse = 0, ssim = 0, flip = 0, distance = 0;
    for (int p = inputs; p < c->images; p++) {
        const float *linear = c->image + (size_t)p * values;
        for (size_t i = 0; i < values; i++) photo[i] = rd_gamma(linear[i]);
        render(c, p, maps, channels, scene);
        rmse += difference(values, photo, scene, exposure);
        if (!perceptual && !lpips) continue;
        expose(values, exposure, scene, shown);
        if (perceptual) flip += ev_flip(c->size, c->size, shown, linear, NULL);
        for (size_t i = 0; i < values; i++) shown[i] = rd_gamma(shown[i]);
        if (perceptual) ssim += ev_ssim(c->size, c->size, shown, photo);
        if (lpips) distance += ev_lpips_distance(lpips, c->size, c->size, shown, photo, NULL);
    }
    row.value[EV_EXPOSURE] = exposure;
    row.value[EV_RENDER] = rmse / (c->images - inputs);
    if (perceptual) row.value[EV_SSIM] = ssim / (c->images - inputs), row.value[EV_FLIP] = flip / (c->images - inputs);
    if (lpips) row.value[EV_LPIPS] = distance / (c->images - inputs);
    if (!ev_perceived(c->size, perceptual, lpips, row.value)) row.value[EV_RENDER] = NAN;
    free(memory);
    return row;
}

void ev_capture_render(const io_capture *c, int picture, const float *maps, int channels, double exposure, float *image)
{
    render(c, picture, maps, channels, image);
    expose((size_t)c->size * (size_t)c->size * 3, exposure, image, image);
}
