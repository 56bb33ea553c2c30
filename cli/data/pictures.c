#include "cli/data/pictures.h"
#include "data/capture.h"
#include "render/ambient.h"
#include "render/render.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

#define AT(field) offsetof(io_camera, field)
const lgd_camera_option lgd_camera_options[LGD_CAMERA_OPTIONS] = {
    {"noise", 1, AT(noise), "sensor noise, 1 as of a phone at night"},
    {"noise-spread", 3, AT(noise_spread), "read and shot noise each up to this many stops stronger or weaker"},
    {"blur", 4, AT(blur), "largest sigma in pixels at 256"},
    {"exposure", 3, AT(exposure), "up to this many stops brighter or darker"},
    {"vignette", 0.9, AT(vignette), "largest share of light lost in the corners"},
    {"white-balance", 0.9, AT(white_balance), "red and blue up to this share stronger or weaker"},
    {"tilt", 30, AT(tilt), "largest angle of the camera in degrees"},
    {"off-centre", 0.4, AT(off_centre), "how far the camera may be off the centre in patch widths"},
    {"fov-min", 120, AT(fov_min), "narrowest field of view in degrees, from 5 on; 0: 54.2 for all"},
    {"fov-max", 120, AT(fov_max), "widest field of view"},
    {"flash", 0.5, AT(flash), "how far the flash may be beside the lens in patch widths"},
    {"ambient", 1, AT(ambient), "largest share of other light"},
    {"tone", 1, AT(tone), "largest strength of a tone curve"},
    {"sharpen", 3, AT(sharpen), "largest amount of sharpening"},
};
const io_camera lgd_default_camera = {.noise = 0.5f, .blur = 0.6f, .quantise = true};

float *lgd_camera_value(io_camera *camera, int option)
{
    return (float *)(void *)((char *)camera + lgd_camera_options[option].at);
}

void lgd_take_photograph(const io_camera *camera, uint64_t seed, uint64_t index, const io_material *m, float *image)
{
    const rd_grid grid = rd_grid_full(m->size);
    io_rig rig = {{0, 0, RD_FLASH_DISTANCE}, {0, 0, RD_FLASH_DISTANCE}, RD_FLASH_POWER};
    rd_view view = rd_flash();
    io_camera_rig(camera, seed, index, &rig);
    memcpy(view.camera, rig.camera, sizeof view.camera);
    memcpy(view.light, rig.light, sizeof view.light);
    view.power = rig.power;
    rd_render(grid, m->maps, MAP_CHANNELS, &view, false, image);
    if (camera->ambient > 0) {
        const io_ambient light = io_camera_ambient(camera, seed, index);
        rd_ambient ambient;
        memcpy(ambient.uniform, light.uniform, sizeof ambient.uniform);
        memcpy(ambient.side, light.side, sizeof ambient.side);
        memcpy(ambient.direction, light.direction, sizeof ambient.direction);
        rd_ambient_add(grid, m->maps, MAP_CHANNELS, &view, &ambient, image);
    }
    io_camera_apply(camera, seed, index, m->size, image);
}

ts_code lgd_write_capture(const char *folder, const io_material *m, ts_status *st)
{
    enum { PICTURES = 9 };
    const size_t values = (size_t)m->size * (size_t)m->size * 3;
    io_capture c;
    ts_code code = io_capture_create(&c, PICTURES, m->size, st);
    c.side = 20;
    for (int i = 0; i < PICTURES && !code; i++) {
        rd_view view = rd_flash();
        const double phi = 6.28318530717958647692 * (i - 1) / (PICTURES - 1);
        if (i > 0) {
            view.camera[0] = (float)(0.45 * cos(phi)), view.camera[1] = (float)(0.45 * sin(phi));
            view.light[0] = view.camera[0] + 0.06f, view.light[1] = view.camera[1];
        }
        memcpy(c.camera[i], view.camera, sizeof view.camera);
        memcpy(c.light[i], view.light, sizeof view.light);
        rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &view, true, c.image + (size_t)i * values);
    }
    for (int k = 0; k < 3; k++) c.power[k] = RD_FLASH_POWER;
    if (!code) code = io_write_capture(folder, &c, st);
    io_capture_free(&c);
    return code;
}
