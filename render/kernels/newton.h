/* Steps of Gauss and Newton's method for rows of pixels: what the maps of a pixel would have to be for its renderings
 * to meet the photographs. */
#ifndef TS_NEWTON_H
#define TS_NEWTON_H
#include "render/kernels/shade.h"
#include "tensor/maps.h"

struct ts_newton_kernels {
    /* Of each pixel by itself: step[count, channels] = -(J' W J + diag(damping))^-1 J' W e, e = seen - image over the
     * views and rgb, seen = radiance up to 1 and 1 + log(radiance) above, or the image itself there, if that is
     * TS_NEWTON_BURNT at least; J = d seen / d maps, W = 1 / (image + TS_NEWTON_NOISE); where maps + step would leave
     * [-1, 1] it ends there. images[v][count, 3], in [0, 1], belongs to views[v]; damping[MAP_CHANNELS] > 0. Channels
     * beyond the maps' are not written. */
    void (*step)(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const float *damping, float *step);
};
/* The variance of a photograph's value grows with it: shot noise, and 8 bits after the gamma curve. */
#define TS_NEWTON_NOISE 0.02f
/* From here on a photograph's value may stand for any that is larger: noise and JPEG leave less than 1 of what was
 * clipped at 1. */
#define TS_NEWTON_BURNT 0.9f
TS_FAMILY(newton)
#endif
