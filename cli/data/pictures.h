/* Pictures that lgd-data takes of materials. */
#ifndef LGD_PICTURES_H
#define LGD_PICTURES_H
#include "data/camera.h"
#include "data/material.h"
#include <stddef.h>

/* The options that set the camera's faults, each a range from 0. */
typedef struct lgd_camera_option {
    const char *name;
    double most;
    size_t at; /* of a float in io_camera */
    const char *help;
} lgd_camera_option;

enum { LGD_CAMERA_OPTIONS = 14 };
extern const lgd_camera_option lgd_camera_options[LGD_CAMERA_OPTIONS];
extern const io_camera lgd_default_camera;
float *lgd_camera_value(io_camera *camera, int option);

/* A photograph under the flash, [size][size][3]. */
void lgd_take_photograph(const io_camera *camera, uint64_t seed, uint64_t index, const io_material *m, float *image);

/* A hand-held phone: the first picture is the flash photograph, the others are taken around it with the flash beside
 * the lens. */
ts_code lgd_write_capture(const char *folder, const io_material *m, ts_status *st);
#endif
