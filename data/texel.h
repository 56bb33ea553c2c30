/* One pixel of maps in the encoding of tensor/maps.h. Inline: writers and estimates do it for every pixel. */
#ifndef IO_TEXEL_H
#define IO_TEXEL_H
#include "tensor/maps.h"
#include <math.h>
#include <stdbool.h>

/* An encoded value of [-1, 1] as one of [0, 1]; NaN to 0. */
static inline float io_unit(float x)
{
    const float v = x * 0.5f + 0.5f;
    return v > 0 ? v < 1 ? v : 1 : 0;
}

/* The reconstructed normal and physical values of one pixel, for writers and statistics. */
typedef struct io_texel {
    float diffuse[3], normal[3], roughness, specular[3];
} io_texel;

static inline float io_level(float v) { return v > 0 ? v < 1 ? 2 * v - 1 : 1 : -1; }

/* To [-1, 1]; NaN to -1: a value still. */
static inline float io_clamped(float x) { return x > -1 ? x < 1 ? x : 1 : -1; }

static inline io_texel io_texel_get(const float *maps9)
{
    io_texel t = {.roughness = io_unit(maps9[MAP_ROUGHNESS])};
    for (int c = 0; c < 3; c++) {
        t.diffuse[c] = io_unit(maps9[MAP_DIFFUSE + c]);
        t.specular[c] = io_unit(maps9[MAP_SPECULAR + c]);
    }
    float x = io_clamped(maps9[MAP_NORMAL]), y = io_clamped(maps9[MAP_NORMAL + 1]);
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

/* The normal is normalised; z < 0 is an error of the caller. */
static inline void io_texel_put(float *maps9, const io_texel *t)
{
    for (int c = 0; c < 3; c++) {
        maps9[MAP_DIFFUSE + c] = io_level(t->diffuse[c]);
        maps9[MAP_SPECULAR + c] = io_level(t->specular[c]);
    }
    maps9[MAP_ROUGHNESS] = io_level(t->roughness);
    float x = t->normal[0], y = t->normal[1], z = t->normal[2], s = x * x + y * y + z * z;
    bool usable = isfinite(s) && s > 1e-12f;
    /* A normal that is of unit length already keeps its exact x and y, so that reading back what was written changes
     * nothing. */
    float scale = !usable ? 0 : fabsf(s - 1) < 1e-6f ? 1 : 1 / sqrtf(s);
    maps9[MAP_NORMAL] = usable ? x * scale : 0;
    maps9[MAP_NORMAL + 1] = usable ? y * scale : 0;
}
#endif
