/* Photographs of materials, with the camera's faults: the networks' input. */
#include "data/camera.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include "train/trainer_internal.h"

static io_camera camera_of(const tr_config *c)
{
    return (io_camera){.noise = (float)c->data.noise,
                       .noise_spread = (float)c->data.noise_spread,
                       .blur = (float)c->data.blur,
                       .quantise = c->data.quantise,
                       .exposure = (float)c->data.exposure,
                       .vignette = (float)c->data.vignette,
                       .white_balance = (float)c->data.white_balance,
                       .jpeg = c->data.jpeg,
                       .tilt = (float)c->data.tilt,
                       .off_centre = (float)c->data.off_centre};
}

void tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                    const rd_view *views, int number, float *images)
{
    const io_camera camera = camera_of(c);
    const size_t pixels = (size_t)size * (size_t)size;
    const uint64_t first = index * (uint64_t)number;
    for (int i = 0; i < count * number; i++) {
        rd_view view = views ? views[i] : rd_flash();
        float moved[3]; /* camera and light together: the tilt or offset of the rig */
        io_camera_place(&camera, seed, first + (uint64_t)i, view.camera[2], moved);
        for (int k = 0; k < 3; k++) {
            const float by = moved[k] - (k == 2 ? view.camera[2] : 0);
            view.camera[k] += by;
            view.light[k] += by;
        }
        const float *material = maps + (size_t)(i / number) * pixels * MAP_CHANNELS;
        rd_render(rd_grid_full(size), material, MAP_CHANNELS, &view, false, images + (size_t)i * pixels * 3);
    }
#pragma omp parallel for num_threads(ts_threads()) schedule(static)
    for (int i = 0; i < count * number; i++)
        io_camera_apply(&camera, seed, first + (uint64_t)i, size, images + (size_t)i * pixels * 3);
}

void tr_capture_views(uint64_t seed, uint64_t index, int count, int number, rd_view *views)
{
    for (int i = 0; i < count; i++) {
        ts_rng rng = ts_rng_make(seed, TS_STREAM_CAPTURE, index + (uint64_t)i);
        rd_capture_draw(&rng, number, views + i * number);
    }
}
