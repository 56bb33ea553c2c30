#include "cli/reflect.h"
#include "render/render.h"
#include "render/scene_model.h"
#include "tensor/maps.h"
#include "tensor/scratch.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

static void render(const rd_view *view, const io_disk *flash, int size, const float *maps, float *image)
{
    const rd_grid grid = rd_grid_full(size);
    if (flash->radius > 0) rd_render_disk(grid, maps, MAP_CHANNELS, view, flash->radius, flash->turn, image);
    else rd_render(grid, maps, MAP_CHANNELS, view, false, image);
}

/* What is mirrored, by roughness times rough. */
static void mirrored(const float *maps, size_t pixels, float rough, float *to)
{
    rd_scene_roughen((int64_t)pixels, maps, MAP_CHANNELS, logf(rough), 0, to);
    for (size_t i = 0; i < pixels * MAP_CHANNELS; i += MAP_CHANNELS)
        for (int k = 0; k < 3; k++) to[i + MAP_DIFFUSE + (size_t)k] = -1;
}

/* What is diffuse: (1 - F0) times the map. A rough surface without F0 mirrors a ten thousandth. */
static void diffuse(const float *maps, size_t pixels, float soft, float *to)
{
    memcpy(to, maps, pixels * MAP_CHANNELS * sizeof *to);
    for (size_t i = 0; i < pixels; i++, to += MAP_CHANNELS) {
        for (int k = 0; k < 3; k++) {
            to[MAP_DIFFUSE + k] = (to[MAP_DIFFUSE + k] + 1) * (1 - to[MAP_SPECULAR + k]) / 2 - 1;
            to[MAP_SPECULAR + k] = -1;
        }
        to[MAP_NORMAL] *= soft;
        to[MAP_NORMAL + 1] *= soft;
        to[MAP_ROUGHNESS] = 1;
    }
}

/* image = keep image + share more */
static void mix(size_t values, float keep, float share, const float *more, float *image)
{
    for (size_t i = 0; i < values; i++) image[i] = keep * image[i] + share * more[i];
}

void cl_reflect(const io_reflection *how, const rd_view *view, const io_disk *flash, int size, const float *maps,
                float *image)
{
    const io_disk point = {0};
    const size_t pixels = (size_t)size * (size_t)size;
    if (how->share <= 0 && how->soft >= 1) {
        render(view, flash, size, maps, image);
        return;
    }
    float *part = ts_scratch(TS_SCRATCH_SLOTS - 1, pixels * (MAP_CHANNELS + 3) * sizeof *part),
          *more = part + pixels * MAP_CHANNELS;
    mirrored(maps, pixels, how->narrow, part);
    render(view, flash, size, part, image);
    if (how->share > 0) {
        mirrored(maps, pixels, how->broad, part);
        render(view, &point, size, part, more);
        mix(pixels * 3, 1 - how->share, how->share, more, image);
    }
    diffuse(maps, pixels, how->soft, part);
    render(view, &point, size, part, more);
    mix(pixels * 3, 1, 1, more, image);
}
