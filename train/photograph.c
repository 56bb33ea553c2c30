/* Photographs of materials, with the camera's faults: the networks' input. */
#include "cli/camera.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include "train/trainer_internal.h"
#include <string.h>

static io_camera camera_of(const tr_config *c)
{
    return (io_camera){.noise = (float)c->data.noise,
                       .noise_spread = (float)c->data.noise_spread,
                       .blur = (float)c->data.blur,
                       .quantise = c->data.quantise,
                       .exposure = (float)c->data.exposure,
                       .meter = (float)c->data.meter,
                       .vignette = (float)c->data.vignette,
                       .white_balance = (float)c->data.white_balance,
                       .jpeg = c->data.jpeg,
                       .tilt = (float)c->data.tilt,
                       .off_centre = (float)c->data.off_centre,
                       .fov_min = (float)c->data.fov_min,
                       .fov_max = (float)c->data.fov_max,
                       .flash = (float)c->data.flash,
                       .ambient = (float)c->data.ambient,
                       .tone = (float)c->data.tone,
                       .sharpen = (float)c->data.sharpen,
                       .told_view = (float)c->data.told_view,
                       .told_power = (float)c->data.told_power};
}

typedef struct taking {
    const io_camera *camera;
    uint64_t seed, first;
    int size;
    float *images;
} taking;

static void take(const void *job, int64_t i)
{
    const taking *t = job;
    io_camera_apply(t->camera, t->seed, t->first + (uint64_t)i, t->size,
                    t->images + (size_t)i * (size_t)t->size * (size_t)t->size * 3);
}

void tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                    const rd_view *views, int number, float *images, tr_shot *shots)
{
    const io_camera camera = camera_of(c);
    const rd_view flash = rd_flash();
    const size_t pixels = (size_t)size * (size_t)size;
    const uint64_t first = index * (uint64_t)number;
    for (int i = 0; i < count * number; i++) {
        const uint64_t which = first + (uint64_t)i;
        const cl_shot s = cl_expose(&camera, seed, which, views ? &views[i] : &flash, size,
                                    maps + (size_t)(i / number) * pixels * MAP_CHANNELS,
                                    images + (size_t)i * pixels * 3);
        if (!shots) continue;
        shots[i] = (tr_shot){.view = s.view, .ambient = s.ambient, .tone = s.tone};
        io_camera_told(&camera, seed, which, &shots[i].told_view, &shots[i].told_power);
    }
    ts_tasks(0, (int64_t)count * number, take, &(taking){&camera, seed, first, size, images});
}

void tr_capture_views(uint64_t seed, uint64_t index, int count, int number, rd_view *views)
{
    for (int i = 0; i < count; i++) {
        ts_rng rng = ts_rng_make(seed, TS_STREAM_CAPTURE, index + (uint64_t)i);
        rd_capture_draw(&rng, number, views + i * number);
    }
}
