#include "cli/camera.h"
#include "cli/cli.h"
#include "cli/reflect.h"
#include "render/ambient.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

#define AT(field) offsetof(io_camera, field)
const cl_camera_option cl_camera_options[CL_CAMERA_OPTIONS] = {
    {"noise", 1, AT(noise), "sensor noise, 1 as of a phone at night"},
    {"noise-spread", 3, AT(noise_spread), "read and shot noise each up to this many stops stronger or weaker"},
    {"blur", 4, AT(blur), "largest sigma in pixels at 256"},
    {"exposure", 3, AT(exposure), "up to this many stops brighter or darker"},
    {"meter", 1, AT(meter), "most that the mean of the picture may be, by less exposure; 0: any"},
    {"automatic", 1, AT(automatic), "share of the photographs whose exposure the camera chose"},
    {"vignette", 0.9, AT(vignette), "largest share of light lost in the corners"},
    {"white-balance", 0.9, AT(white_balance), "red and blue up to this share stronger or weaker"},
    {"tilt", 30, AT(tilt), "largest angle of the camera in degrees"},
    {"off-centre", 0.4, AT(off_centre), "how far the camera may be off the centre in patch widths"},
    {"fov-min", 120, AT(fov_min), "narrowest field of view in degrees, from 5 on; 0: 54.2 for all"},
    {"fov-max", 120, AT(fov_max), "widest field of view"},
    {"flash", 0.5, AT(flash), "how far the flash may be beside the lens in patch widths"},
    {"flash-size", 0.1, AT(flash_size), "largest radius of the flash as a share of its distance"},
    {"glare", 0.5, AT(glare), "largest share of the light that the lens scatters"},
    {"lobes", 0.5, AT(lobes), "largest share of the mirrored light in a second, broader lobe"},
    {"soften", 1, AT(soften), "largest share of the relief that diffuse shading does not show"},
    {"ambient", 1, AT(ambient), "largest share of other light"},
    {"tone", 1, AT(tone), "largest strength of a tone curve"},
    {"sharpen", 3, AT(sharpen), "largest amount of sharpening"},
};

const io_camera cl_camera_default = {.noise = 0.5f, .blur = 0.6f, .quantise = true},
                cl_camera_phone = {.noise = 0.04f,
                                   .noise_spread = 3,
                                   .blur = 0.4f,
                                   .quantise = true,
                                   .exposure = 1.5f,
                                   .meter = 0.5f,
                                   .vignette = 0.35f,
                                   .white_balance = 0.08f,
                                   .jpeg = 92,
                                   .tilt = 10,
                                   .off_centre = 0.08f,
                                   .fov_min = 12,
                                   .fov_max = 75,
                                   .flash = 0.2f,
                                   .flash_size = 0.015f,
                                   .glare = 0.1f,
                                   .ambient = 0.15f,
                                   .tone = 0.6f,
                                   .sharpen = 0.3f};

float *cl_camera_value(io_camera *camera, int option)
{
    return (float *)(void *)((char *)camera + cl_camera_options[option].at);
}

static ts_code parse_range(char *pair, io_camera *camera, ts_status *st)
{
    char *value = strchr(pair, '=');
    if (value) *value++ = 0;
    for (int i = 0; i < CL_CAMERA_OPTIONS && value; i++) {
        double x;
        const cl_camera_option *o = &cl_camera_options[i];
        if (strcmp(o->name, pair)) continue;
        if (!cl_parse_real(value, 0, o->most, &x))
            return ts_fail(st, TS_INVALID, "--camera: %s is '%s', not a number in 0 .. %g", pair, value, o->most);
        *cl_camera_value(camera, i) = (float)x;
        return TS_OK;
    }
    return ts_fail(st, TS_INVALID, "--camera: '%s' is neither phone nor KEY=VALUE of lgd-data --help's photographs",
                   pair);
}

ts_code cl_camera_parse(const char *text, io_camera *camera, ts_status *st)
{
    char copy[512], *left = NULL;
    *camera = cl_camera_phone;
    if (!strcmp(text, "phone")) return TS_OK;
    *camera = (io_camera){.quantise = true};
    if (strlen(text) >= sizeof copy) return ts_fail(st, TS_INVALID, "--camera: is too long");
    strcpy(copy, text);
    char *pair = strtok_r(copy, ",", &left);
    if (!pair) return ts_fail(st, TS_INVALID, "--camera: names nothing");
    for (; pair; pair = strtok_r(NULL, ",", &left))
        if (parse_range(pair, camera, st) != TS_OK) return st->code;
    if ((camera->fov_min > 0 || camera->fov_max > 0) && !(camera->fov_min >= 5 && camera->fov_max >= camera->fov_min))
        return ts_fail(st, TS_INVALID, "--camera: fov-min is %g and fov-max %g: they must be 5 or more, and in order",
                       (double)camera->fov_min, (double)camera->fov_max);
    return TS_OK;
}

static float add_ambient(const io_camera *camera, uint64_t seed, uint64_t index, int size, const float *maps,
                         const rd_view *view, float *image)
{
    const io_ambient light = io_camera_ambient(camera, seed, index);
    rd_ambient ambient;
    memcpy(ambient.uniform, light.uniform, sizeof ambient.uniform);
    memcpy(ambient.side, light.side, sizeof ambient.side);
    memcpy(ambient.direction, light.direction, sizeof ambient.direction);
    rd_ambient_add(rd_grid_full(size), maps, MAP_CHANNELS, view, &ambient, image);
    return light.share;
}

cl_shot cl_expose(const io_camera *camera, uint64_t seed, uint64_t index, const rd_view *planned, int size,
                  const float *maps, float *image)
{
    cl_shot shot = {.view = *planned, .tone = io_camera_tone(camera, seed, index).contrast};
    io_rig rig = {.power = planned->power};
    memcpy(rig.camera, planned->camera, sizeof rig.camera);
    memcpy(rig.light, planned->light, sizeof rig.light);
    io_camera_rig(camera, seed, index, &rig);
    memcpy(shot.view.camera, rig.camera, sizeof rig.camera);
    memcpy(shot.view.light, rig.light, sizeof rig.light);
    shot.view.power = rig.power;
    const io_disk flash = io_camera_flash(camera, seed, index, shot.view.light[2]);
    const io_reflection reflection = io_camera_reflection(camera, seed, index);
    cl_reflect(&reflection, &shot.view, &flash, size, maps, image);
    if (camera->ambient > 0) shot.ambient = add_ambient(camera, seed, index, size, maps, &shot.view, image);
    const float metered = io_camera_meter(camera, seed, index, size, image);
    for (size_t i = 0; metered != 1 && i < (size_t)size * (size_t)size * 3; i++) image[i] *= metered;
    shot.view.power *= metered * io_camera_exposure(camera, seed, index);
    return shot;
}

cl_shot cl_photograph(const io_camera *camera, uint64_t seed, uint64_t index, const rd_view *planned, int size,
                      const float *maps, float *image)
{
    const cl_shot shot = cl_expose(camera, seed, index, planned, size, maps, image);
    io_camera_apply(camera, seed, index, size, image);
    return shot;
}
