/* Gauss-Newton steps for rows of pixels: toward maps whose renderings fit the photographs. */
#ifndef TS_NEWTON_H
#define TS_NEWTON_H
#include "render/kernels/view.h"
#include "tensor/kernels/family.h"
#include "tensor/maps.h"

struct ts_newton_kernels {
    /* For each pixel by itself, over the views and rgb (S8 to S10 of docs/math.md):
     *
     *     step[count, channels] = -(J' W J + diag(damping))^-1 J' W e,  W = 1 / (image + TS_NEWTON_NOISE)
     *     e = seen - image,  J = d seen / d maps
     *     seen = radiance up to 1, 1 + log(radiance) above; above 1 and where image >= TS_NEWTON_BURNT: e = 0, J = 0
     *
     * where seen and J are of the maps cut to [-1, 1]. The step leads from the maps as they are and is cut where they
     * would end outside [-1, 1]. images[v][count, 3], in [0, 1], belongs to views[v]; damping[MAP_CHANNELS] > 0.
     * Channels beyond the maps' become 0. */
    void (*step)(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const float *damping, float *step);
};
/* The variance of a photograph's value grows with it: shot noise, and 8 bits after the gamma curve. */
#define TS_NEWTON_NOISE 0.02f
/* A photograph's value counts as saturated from here on: noise and JPEG leave less than 1 of what was clipped at 1. */
#define TS_NEWTON_BURNT 0.9f
TS_FAMILY(newton)
#endif
