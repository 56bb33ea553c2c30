/* Metal or dielectric, as a whole material. */
#ifndef NN_KIND_H
#define NN_KIND_H
#include <stdbool.h>
#include <stdint.h>

/* A metal's F0 over the diffuse of a dielectric that looks alike. */
#define NN_METAL_F0 1.4f

/* What a sample is known to be, all of it. */
typedef enum nn_kind { NN_KIND_UNKNOWN, NN_KIND_DIELECTRIC, NN_KIND_METAL } nn_kind;

/* Of maps [pixels][channels], encoded (tensor/maps.h): whether the mean F0 is above the mean diffuse. */
bool nn_is_metal(int64_t pixels, int channels, const float *maps);

/* What was a metal becomes a dielectric, with F0 / NN_METAL_F0 more diffuse and the F0 of plastic; a dielectric a
 * metal, with NN_METAL_F0 diffuse more F0 and nearly black diffuse. Each value ends in [-1, 1]. */
void nn_change_kind(bool metal, int64_t pixels, int channels, float *maps);

/* Maps as a sample of the kind has them, and the deviations [pixels][MAP_GROUPS] of what it leaves open. A metal has
 * NN_METAL_F0 diffuse more F0 in every pixel and next to no diffuse; where its mean F0 is still below what metals have,
 * it is that under a weaker light. The maps of a dielectric whose mean F0 is above what dielectrics have are darker
 * until it is plastic's: what looked like a metal is dark under a stronger light. Returns by how many stops the light
 * is stronger; where its power is known 0: a metal's F0 stays, and what a dielectric's loses goes to diffuse. */
float nn_take_kind(nn_kind kind, bool power_known, int64_t pixels, int channels, float *maps);
void nn_deviations_of_kind(nn_kind kind, int64_t pixels, float *deviation);
#endif
