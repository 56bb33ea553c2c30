/* Fields of numbers over the pixels of a patch: gradient noise and its sums, cells, bricks. Every function fills whole
 * planes, so that the loops vectorise; nothing here calls libm, so that the bytes depend on the compiler's plain IEEE
 * arithmetic alone. */
#ifndef IO_NOISE_H
#define IO_NOISE_H
#include "tensor/kernels/noise.h"
#include <stdint.h>

/* Coordinates of every pixel, and how large a pixel is in their unit (the larger of the two directions): detail finer
 * than that is left out. */
typedef struct nz_frame {
    int count;
    float *u, *v;
    float step;
} nz_frame;

typedef enum nz_kind {
    NZ_SMOOTH, /* the noise itself */
    NZ_RIDGED, /* 1 - |noise|: sharp crests */
    NZ_BILLOW  /* |noise|: sharp valleys */
} nz_kind;

/* A sum of octaves of gradient noise (Perlin, "Improving Noise", 2002; hash instead of a table), mean 0, standard
 * deviation about 1. Octave k has frequency * 2^k cycles per unit and gain^k of the amplitude; octaves above half a
 * cycle per pixel are left out and those near it are weakened, without rescaling the rest: a smaller image is the
 * larger one without its finest detail. */
void nz_fbm(nz_frame f, nz_kind kind, float frequency, int octaves, float gain, uint32_t seed, float *out);

/* The cell around each pixel's nearest feature point (Worley, "A Cellular Texture Basis Function", 1996); any plane may
 * be NULL. All lengths are in cells. */
typedef struct nz_cells {
    float *near;  /* distance to the point */
    float *edge;  /* distance to the border with the next nearest point's cell */
    float *id;    /* a number in [0, 1) that belongs to the cell */
    float *x, *y; /* from the cell's point to the pixel */
} nz_cells;
/* jitter 0: a regular lattice .. 1. stagger shifts odd rows (0.5 with rows sqrt(3)/2 apart gives hexagons). */
void nz_cell(nz_frame f, float frequency, float jitter, float stagger, uint32_t seed, nz_cells out);

/* Rectangles in rows one unit high: width units wide, each row shifted by shift (of a width) more than the one before,
 * and by up to loose at random; corners rounded by round. edge: distance to the border, positive inside, in units. */
typedef struct nz_brick_shape {
    float width, shift, loose, round;
} nz_brick_shape;
void nz_brick(nz_frame f, nz_brick_shape shape, uint32_t seed,
              nz_cells out); /* near is not written; x, y from the centre */
/* Blocks one unit wide and length units long in a herringbone; x runs along each block. near is not written. */
void nz_herringbone(nz_frame f, int length, float round, uint32_t seed, nz_cells out);

/* A square plane blurred by a box of 2 radius + 1 pixels, three times (nearly a Gaussian of sigma radius), edges
 * repeated. work: another plane. */
void nz_blur(int size, int radius, const float *in, float *out, float *work);

static inline float nz_min(float a, float b) { return a < b ? a : b; }
static inline float nz_max(float a, float b) { return a > b ? a : b; }
static inline float nz_clamp(float x, float lo, float hi) { return nz_min(nz_max(x, lo), hi); }
static inline float nz_mix(float a, float b, float t) { return a + (b - a) * t; }
static inline float nz_abs(float x) { return x < 0 ? -x : x; }
static inline float nz_floor(float x)
{
    float t = (float)(int32_t)x;
    return t > x ? t - 1 : t;
}
/* 0 at lo and beyond, 1 at hi and beyond, smooth between; lo may be the larger one. */
static inline float nz_smooth(float lo, float hi, float x)
{
    float t = nz_clamp((x - lo) / (hi - lo), 0, 1);
    return t * t * (3 - 2 * t);
}
/* 1 at 0, falling smoothly to 0 at |x| = 1. */
static inline float nz_bump(float x)
{
    float t = nz_max(0, 1 - x * x);
    return t * t;
}
/* sin(2 pi t) to 0.001, for a pattern and not for mathematics. */
static inline float nz_sine(float t)
{
    float x = t - nz_floor(t) - 0.5f, y = (16 * nz_abs(x) - 8) * x;
    return y + 0.225f * (y * nz_abs(y) - y);
}
static inline uint32_t nz_hash(int32_t x, int32_t y, uint32_t seed) { return ts_noise_hash(x, y, seed); }
static inline float nz_unit(uint32_t h) { return (float)(int32_t)(h >> 8) * (1.0f / 16777216.0f); }
/* Another number in [0, 1) that belongs to the same cell. */
static inline float nz_again(float id, uint32_t which)
{
    return nz_unit(nz_hash((int32_t)(id * 16777216.0f), (int32_t)which, 77));
}
#endif
