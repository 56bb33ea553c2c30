/* Metal or dielectric, as a whole material. */
#ifndef NN_KIND_H
#define NN_KIND_H
#include <stdbool.h>
#include <stdint.h>

/* A metal's F0 over the diffuse of a dielectric that looks alike. */
#define NN_METAL_F0 1.4f

/* Of maps [pixels][channels], encoded (tensor/maps.h): whether the mean F0 is above the mean diffuse. */
bool nn_is_metal(int64_t pixels, int channels, const float *maps);

/* What was a metal becomes a dielectric, with F0 / NN_METAL_F0 more diffuse and the F0 of plastic; a dielectric a
 * metal, with NN_METAL_F0 diffuse more F0 and nearly black diffuse. Each value ends in [-1, 1]. */
void nn_change_kind(bool metal, int64_t pixels, int channels, float *maps);
#endif
