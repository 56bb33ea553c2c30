#include "infer/sheet.h"
#include "infer/angle.h"
#include "nn/clip.h"
#include "render/scene.h"
#include <math.h>
#include <string.h>

void lgd_sheet_order(const io_sheet_set *set, int order[IO_SOLVE_MOST])
{
    bool taken[IO_SOLVE_MOST] = {false};
    for (int n = 0; n < set->good; n++) {
        double best = -INFINITY;
        for (int i = 0; i < set->photos; i++) {
            const io_pinhole *c = &set->photo[i].sight.camera;
            double good = n ? INFINITY : -io_pinhole_tilt(c);
            if (set->photo[i].st.code || taken[i]) continue;
            for (int k = 0; k < n; k++) {
                const double *at = set->photo[order[k]].sight.camera.at;
                good = fmin(good, hypot(hypot(c->at[0] - at[0], c->at[1] - at[1]), c->at[2] - at[2]));
            }
            if (good > best) best = good, order[n] = i;
        }
        taken[order[n]] = true;
    }
}

static ts_code add(const io_sheet_set *set, const io_sheet_photo *p, int k, int64_t max_pixels, int threads,
                   io_capture *c, ts_status *st)
{
    const double pi = 3.14159265358979323846, light[3] = {set->aside[0], set->aside[1], 0};
    const lgd_photo photo = lgd_photo_by(&p->sight.camera, light, NULL);
    io_image window;
    if (io_sheet_window(p, c->size, max_pixels, threads, &window, st) != TS_OK) return st->code;
    memcpy(c->camera[k], photo.camera, sizeof photo.camera);
    memcpy(c->light[k], photo.light, sizeof photo.light);
    if (k == 0)
        for (int i = 0; i < 3; i++) c->power[i] = photo.power;
    const ts_code code = io_capture_note(c, k, p->path, (int)ceil(io_sheet_window_side(p)), window.data, st);
    float gain[3];
    for (int i = 0; i < 3; i++) gain[i] = c->power[i] * (float)(IO_SHEET_PAPER / (pi * p->exposure[i]));
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    float *to = c->image + (size_t)k * values;
    for (size_t i = 0; i < values; i++) to[i] = window.data[i] * gain[i % 3];
    nn_clip((int64_t)values, to, to);
    io_image_free(&window);
    return code;
}

ts_code lgd_sheet_capture(const io_sheet_set *set, int most, int size, int64_t max_pixels, int threads, io_capture *c,
                          ts_status *st)
{
    int order[IO_SOLVE_MOST];
    const int count = set->good < most ? set->good : most;
    lgd_sheet_order(set, order);
    ts_code code = io_capture_create(c, count, size, st);
    for (int k = 0; k < count && !code; k++) code = add(set, &set->photo[order[k]], k, max_pixels, threads, c, st);
    if (code) io_capture_free(c);
    return code;
}
