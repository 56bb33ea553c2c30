/* Errors of maps against other maps (docs/math.md, M15 and M16), for training's validation and lgd-eval. */
#ifndef RD_ERROR_H
#define RD_ERROR_H
#include "render/scene.h"

enum { RD_EVAL_VIEWS = 20 };

/* Mean over views of the RMSE (all pixels, rgb) between the renderings of two materials, each clamped to [0, 1] and
 * raised to 1/2.2. maps_a [h, w, channels_a], maps_b [h, w, channels_b]. Threaded; the same bytes for any number of
 * threads. -1 when memory for the renderings cannot be had (two images of the grid's size), NaN where count < 1. */
double rd_render_rmse(rd_grid grid, const float *maps_a, int channels_a, const float *maps_b, int channels_b,
                      const rd_view *views, int count);

typedef struct rd_map_error {
    double diffuse, specular; /* of v^(1/2.2), v = (x + 1) / 2 in [0, 1] */
    double roughness;         /* of v */
    double normal;            /* of the unit vector's three components, each in [-1, 1] */
    double angle;             /* not an RMSE: the mean angle between the normals, in degrees */
} rd_map_error;

/* RMSE of each map over count pixels and the map's components. Values are clamped to [-1, 1] first, as in
 * rendering and in files. */
rd_map_error rd_map_rmse(int64_t count, const float *maps_a, int channels_a, const float *maps_b, int channels_b);
#endif
