/* What a step of Gauss and Newton's method solves (render/render.h), in double. */
#ifndef TESTS_NORMAL_EQUATIONS_H
#define TESTS_NORMAL_EQUATIONS_H
#include "render/brdf.h"
#include "render/kernels/newton.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include <math.h>
#include <stdbool.h>

/* Of the pixel at point, whose maps are given: a = J' W J + damping, b = -J' W e over image[0 .. count-1]'s values at
 * pixel. */
static inline void normal_equations(const float *maps, const double point[2], const rd_view *views,
                                    const float *const *image, int64_t pixel, int count, const float *damping,
                                    double a[MAP_CHANNELS][MAP_CHANNELS], double b[MAP_CHANNELS])
{
    double m[MAP_CHANNELS];
    for (int i = 0; i < MAP_CHANNELS; i++) {
        m[i] = fmin(fmax((double)maps[i], -1), 1);
        b[i] = 0;
        for (int j = 0; j < MAP_CHANNELS; j++) a[i][j] = i == j ? (double)damping[i] : 0;
    }
    for (int k = 0; k < count; k++) {
        double value[3], by[3][MAP_CHANNELS];
        rd_radiance(m, point, &views[k], value, by);
        for (int c = 0; c < 3; c++) {
            const double target = (double)image[k][pixel * 3 + c], w = 1 / (target + (double)TS_NEWTON_NOISE);
            if (value[c] > 1 && image[k][pixel * 3 + c] >= TS_NEWTON_BURNT) continue;
            const double seen = value[c] > 1 ? 1 + log(value[c]) : value[c], slope = 1 / fmax(value[c], 1);
            for (int i = 0; i < MAP_CHANNELS; i++) {
                b[i] -= w * slope * by[c][i] * (seen - target);
                for (int j = 0; j < MAP_CHANNELS; j++) a[i][j] += w * slope * slope * by[c][i] * by[c][j];
            }
        }
    }
}

/* Every fourth value is put to an end of [-1, 1], or a rounding or more beyond; cut: what of it is in [-1, 1]. */
static inline void push_out(ts_rng *rng, int pixels, float *maps, float *cut)
{
    static const float beyond[] = {0, 1.2e-7f, 1e-6f, 1e-3f, 0.3f};
    for (int i = 0; i < pixels * MAP_CHANNELS; i++) {
        const int channel = i % MAP_CHANNELS;
        const bool normal = channel == MAP_NORMAL || channel == MAP_NORMAL + 1;
        if (!normal && !ts_rng_int(rng, 4))
            maps[i] = (1 + beyond[ts_rng_int(rng, 5)]) *
                (channel != MAP_ROUGHNESS && ts_rng_int(rng, 2) ? -1.0f : 1.0f);
        cut[i] = fminf(fmaxf(maps[i], -1), 1);
    }
}

/* x = a^-1 b by Gauss's elimination, which leaves its traces in a and b; a is positive definite and needs no pivots. */
static inline void normal_solve(double a[MAP_CHANNELS][MAP_CHANNELS], double b[MAP_CHANNELS], double x[MAP_CHANNELS])
{
    for (int i = 0; i < MAP_CHANNELS; i++)
        for (int j = i + 1; j < MAP_CHANNELS; j++) {
            const double f = a[j][i] / a[i][i];
            for (int k = i; k < MAP_CHANNELS; k++) a[j][k] -= f * a[i][k];
            b[j] -= f * b[i];
        }
    for (int i = MAP_CHANNELS - 1; i >= 0; i--) {
        x[i] = b[i];
        for (int k = i + 1; k < MAP_CHANNELS; k++) x[i] -= a[i][k] * x[k];
        x[i] /= a[i][i];
    }
}
#endif
