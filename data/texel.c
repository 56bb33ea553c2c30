/* The encoding of tensor/maps.h, one pixel at a time. */
#include "data/texel.h"
#include <math.h>
#include <stdbool.h>

static float level(float v) { return v > 0 ? v < 1 ? 2 * v - 1 : 1 : -1; }

/* To [-1, 1]; NaN to -1: a value still. */
static float clamped(float x) { return x > -1 ? x < 1 ? x : 1 : -1; }

io_texel io_texel_get(const float *maps9)
{
    io_texel t = {.roughness = io_unit(maps9[MAP_ROUGHNESS])};
    for (int c = 0; c < 3; c++) {
        t.diffuse[c] = io_unit(maps9[MAP_DIFFUSE + c]);
        t.specular[c] = io_unit(maps9[MAP_SPECULAR + c]);
    }
    float x = clamped(maps9[MAP_NORMAL]), y = clamped(maps9[MAP_NORMAL + 1]);
    float s = x * x + y * y;
    /* Refined maps may leave the unit circle; the renderer's rule (n_x^2 + n_y^2 at most 1 - 1e-6, then unit length)
     * keeps z above 0. */
    if (s > 1 - 1e-6f) {
        float length = sqrtf(s + 1e-6f);
        t.normal[0] = x / length;
        t.normal[1] = y / length;
        t.normal[2] = 1e-3f / length;
    } else {
        t.normal[0] = x;
        t.normal[1] = y;
        t.normal[2] = sqrtf(1 - s);
    }
    return t;
}

void io_texel_put(float *maps9, const io_texel *t)
{
    for (int c = 0; c < 3; c++) {
        maps9[MAP_DIFFUSE + c] = level(t->diffuse[c]);
        maps9[MAP_SPECULAR + c] = level(t->specular[c]);
    }
    maps9[MAP_ROUGHNESS] = level(t->roughness);
    float x = t->normal[0], y = t->normal[1], z = t->normal[2], s = x * x + y * y + z * z;
    bool usable = isfinite(s) && s > 1e-12f;
    /* A normal that is of unit length already keeps its exact x and y, so that reading back what was written changes
     * nothing. */
    float scale = !usable ? 0 : fabsf(s - 1) < 1e-6f ? 1 : 1 / sqrtf(s);
    maps9[MAP_NORMAL] = usable ? x * scale : 0;
    maps9[MAP_NORMAL + 1] = usable ? y * scale : 0;
}
