#include "data/materials/plain.h"

#define METALLIC 0.2f /* F0 from which on something is no dielectric */

static double mean_of(const io_canvas *c, const float *plane)
{
    double sum = 0;
    for (int i = 0; i < c->count; i++) sum += (double)plane[i];
    return sum / c->count;
}

static bool dielectric(const io_canvas *c)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < c->count; i++)
            if (c->specular[k][i] > METALLIC) return false;
    return true;
}

void cv_plain(io_canvas *c)
{
    const float u = cv_range(c, 0, 1), v = cv_range(c, 0, 1), level = cv_range(c, 0.15f, 0.75f);
    const bool other = cv_chance(c, 0.5f);
    const float mean = (float)mean_of(c, c->roughness), to = other ? level : mean;
    for (int i = 0; i < c->count; i++) {
        c->roughness[i] = nz_clamp(to + u * u * (c->roughness[i] - mean), 0.02f, 1);
        c->height[i] *= v * v;
    }
    if (!dielectric(c)) return;
    for (int k = 0; k < 3; k++) {
        const float one = (float)mean_of(c, c->specular[k]);
        for (int i = 0; i < c->count; i++) c->specular[k][i] = one;
    }
}
