/* Photographs of known maps, taken by a camera with faults (data/camera.h). */
#ifndef CL_CAMERA_H
#define CL_CAMERA_H
#include "data/camera.h"
#include "render/render.h"
#include <stddef.h>

/* The options that set the camera's faults, each a range from 0. */
typedef struct cl_camera_option {
    const char *name;
    double most;
    size_t at; /* of a float in io_camera */
    const char *help;
} cl_camera_option;

enum { CL_CAMERA_OPTIONS = 20 };
extern const cl_camera_option cl_camera_options[CL_CAMERA_OPTIONS];
float *cl_camera_value(io_camera *camera, int option);

/* A careful photographer's, and a phone's in anybody's hands: the camera of configs/single-phone.ini. What a model is
 * given of a photograph (told_view, told_power) is no part of it. */
extern const io_camera cl_camera_default, cl_camera_phone;

/* text: "phone", or KEY=VALUE,... of the options' names, what is not named being 0. TS_INVALID, with a message that
 * names --camera, for anything else. */
ts_code cl_camera_parse(const char *text, io_camera *camera, ts_status *st);

/* What is true of a photograph: the radiance under view, with the ambient light, is what the camera saw before its
 * other faults, tone curve and clipping. */
typedef struct cl_shot {
    rd_view view;  /* the light's power has the exposure in it */
    float ambient; /* the other light's share (render/ambient.h) */
    float tone;    /* contrast of the tone curve, 0: none */
} cl_shot;

/* The radiance that photograph (seed, index) of maps [size][size][MAP_CHANNELS] gets, before exposure and the camera's
 * other faults: image [size][size][3], not clamped, to which io_camera_apply is still to be applied. planned: the view
 * without tilt, offsets and field of view. */
cl_shot cl_expose(const io_camera *camera, uint64_t seed, uint64_t index, const rd_view *planned, int size,
                  const float *maps, float *image);

/* The whole photograph. */
cl_shot cl_photograph(const io_camera *camera, uint64_t seed, uint64_t index, const rd_view *planned, int size,
                      const float *maps, float *image);
#endif
