/* Diffuse and specular maps as base colour and metalness. */
#ifndef IO_METALLIC_H
#define IO_METALLIC_H
#include "data/material.h"

/* The error of the conversion: RMS over all pixels and channels, linear. */
typedef struct io_metallic_error {
    double diffuse, specular;
} io_metallic_error;

/* basecolor [size][size][3] linear, metallic [size][size], both in [0, 1], so that base (1 - metallic) and
 * 0.04 (1 - metallic) + base metallic come nearest to diffuse and F0 in the sum of squares, pixel by pixel; but
 * where both are dark metalness costs something, so that what is black is a dielectric. threads: 0: the process's
 * number. */
io_metallic_error io_to_metallic(const io_material *m, float *basecolor, float *metallic, int threads);
#endif
