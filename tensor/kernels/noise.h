/* Gradient noise and cells at many points, and normal random numbers. Nothing is contracted to FMA here (the Makefile
 * says so): every instruction set gives the same bytes, so that procedural materials do not depend on the machine. */
#ifndef TS_KERNELS_NOISE_H
#define TS_KERNELS_NOISE_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stdint.h>

/* What belongs to lattice point (x, y): a hash by shifts and products. */
static inline uint32_t ts_noise_hash(int32_t x, int32_t y, uint32_t seed)
{
    uint32_t h = (uint32_t)x * 0x8da6b343u + (uint32_t)y * 0xd8163841u + seed * 0xcb1ab31fu;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ h >> 15;
}

/* Gradient noise of unit lattice has this standard deviation with gradients uniform in the square [-1, 1]^2 (measured).
 */
#define TS_NOISE_DEVIATION 0.1762f

/* Where cells are looked for, see nz_cell (data/materials/noise.h); lengths in cells. */
typedef struct ts_noise_cells {
    float frequency, jitter, stagger;
    uint32_t seed;
} ts_noise_cells;

struct ts_noise_kernels {
    /* out[i] += amplitude noise(u[i] frequency + shift_u, v[i] frequency + shift_v), noise of standard deviation 1 with
     * the quintic fade (Perlin, "Improving Noise", 2002). folded: of (0.798 - |noise|) / 0.603 instead, mean 0 and
     * deviation 1 again. */
    void (*octave)(int n, const float *u, const float *v, float frequency, float shift_u, float shift_v, uint32_t seed,
                   bool folded, float amplitude, float *out);
    /* The nearest of the nine feature points around: near its distance, edge the distance to the border with the
     * second's cell, id in [0, 1), x and y from the point. Any may be NULL. */
    void (*cell)(int n, const float *u, const float *v, ts_noise_cells c, float *near, float *edge, float *id, float *x,
                 float *y);
    /* out[2i] and out[2i + 1], i < blocks: the normal random numbers of ts_rng_normal (tensor/rng.h) by Philox block
     * counter[0] + i, in float: within 3e-4 of its double. */
    void (*normal)(int64_t blocks, const uint32_t key[2], const uint32_t counter[4], float *out);
};
TS_FAMILY(noise)

/* The same in plain C, for tests. */
extern const struct ts_noise_kernels ts_noise_naive;
#endif
