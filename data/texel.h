/* One pixel of maps in the encoding of tensor/maps.h. */
#ifndef IO_TEXEL_H
#define IO_TEXEL_H
#include "tensor/maps.h"

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
io_texel io_texel_get(const float *maps9);
void io_texel_put(float *maps9, const io_texel *t); /* the normal is normalised; z < 0 is an error of the caller */
#endif
