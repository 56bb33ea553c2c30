/* Photographs of materials, with the camera's faults: the networks' input. */
#include "data/camera.h"
#include "render/ambient.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include "train/trainer_internal.h"
#include <string.h>

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

static void add_ambient(const io_camera *camera, uint64_t seed, uint64_t index, int size, const float *material,
                        tr_shot *shot, float *image)
{
    const io_ambient light = io_camera_ambient(camera, seed, index);
    rd_ambient ambient;
    memcpy(ambient.uniform, light.uniform, sizeof ambient.uniform);
    memcpy(ambient.side, light.side, sizeof ambient.side);
    memcpy(ambient.direction, light.direction, sizeof ambient.direction);
    shot->ambient = light.share;
    rd_ambient_add(rd_grid_full(size), material, MAP_CHANNELS, &shot->view, &ambient, image);
}

static tr_shot shoot(const io_camera *camera, uint64_t seed, uint64_t index, const rd_view *planned)
{
    tr_shot shot = {.view = *planned};
    io_rig rig = {.power = planned->power};
    memcpy(rig.camera, planned->camera, sizeof rig.camera);
    memcpy(rig.light, planned->light, sizeof rig.light);
    io_camera_rig(camera, seed, index, &rig);
    memcpy(shot.view.camera, rig.camera, sizeof rig.camera);
    memcpy(shot.view.light, rig.light, sizeof rig.light);
    shot.view.power = rig.power;
    shot.tone = io_camera_tone(camera, seed, index).contrast;
    io_camera_told(camera, seed, index, &shot.told_view, &shot.told_power);
    return shot;
}

void tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                    const rd_view *views, int number, float *images, tr_shot *shots)
{
    const io_camera camera = camera_of(c);
    const rd_view flash = rd_flash();
    const size_t pixels = (size_t)size * (size_t)size;
    const uint64_t first = index * (uint64_t)number;
    for (int i = 0; i < count * number; i++) {
        tr_shot shot = shoot(&camera, seed, first + (uint64_t)i, views ? &views[i] : &flash);
        const float *material = maps + (size_t)(i / number) * pixels * MAP_CHANNELS;
        float *image = images + (size_t)i * pixels * 3;
        rd_render(rd_grid_full(size), material, MAP_CHANNELS, &shot.view, false, image);
        if (camera.ambient > 0) add_ambient(&camera, seed, first + (uint64_t)i, size, material, &shot, image);
        if (!shots) continue;
        shot.view.power *= io_camera_exposure(&camera, seed, first + (uint64_t)i);
        shots[i] = shot;
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
