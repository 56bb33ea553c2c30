/* Random maps of which a photograph tells its scene: relief is low, F0 a dielectric's. */
#ifndef TESTS_SCENE_MAPS_H
#define TESTS_SCENE_MAPS_H
#include "tests/support/shading.h"

static inline void scene_maps(ts_rng *rng, int pixels, float *maps)
{
    for (int i = 0; i < pixels * C; i++) {
        const int m = i % C;
        const bool normal = m == MAP_NORMAL || m == MAP_NORMAL + 1;
        maps[i] = m >= MAP_SPECULAR ? ts_rng_range(rng, -0.95f, -0.6f)
            : m == MAP_ROUGHNESS    ? ts_rng_range(rng, -0.3f, 0.4f)
                                    : ts_rng_range(rng, -0.2f, 0.2f) * (normal ? 1 : 3);
    }
}
#endif
