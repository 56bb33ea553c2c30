#include "data/materials/blend.h"

static void mean(int count, float weight, const float *other, float *own)
{
    for (int i = 0; i < count; i++) own[i] = nz_mix(own[i], other[i], weight);
}

void cv_blend(io_canvas *c, const io_canvas *other, float weight)
{
    mean(c->count, weight, other->height, c->height);
    for (int k = 0; k < 3; k++) {
        mean(c->count, weight, other->diffuse[k], c->diffuse[k]);
        mean(c->count, weight, other->specular[k], c->specular[k]);
    }
    mean(c->count, weight, other->roughness, c->roughness);
}
