/* The naive twin of tensor/kernels/noise.c: a point at a time. The same operations in the same order, since the bytes
 * must be the same. */
#include "tensor/kernels/noise.h"
#include "tensor/rng.h"
#include <math.h>
#include <stddef.h>

/* The gradient at a lattice point times the offset from it. */
static float gradient(int32_t x, int32_t y, uint32_t seed, float dx, float dy)
{
    uint32_t h = (uint32_t)x * 0x8da6b343u + (uint32_t)y * 0xd8163841u + seed * 0xcb1ab31fu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h ^= h >> 13;
    return ((float)(h & 0xffff) - 32767.5f) * dx + ((float)(h >> 16) - 32767.5f) * dy;
}

static float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

static void octave(int n, const float *u, const float *v, float frequency, float shift_u, float shift_v, uint32_t seed,
                   bool folded, float amplitude, float *out)
{
    for (int i = 0; i < n; i++) {
        const float px = u[i] * frequency + shift_u, py = v[i] * frequency + shift_v;
        const int32_t x = (int32_t)floorf(px), y = (int32_t)floorf(py);
        const float dx = px - (float)x, dy = py - (float)y, s = fade(dx), t = fade(dy);
        const float a = gradient(x, y, seed, dx, dy), b = gradient(x + 1, y, seed, dx - 1, dy);
        const float c = gradient(x, y + 1, seed, dx, dy - 1), d = gradient(x + 1, y + 1, seed, dx - 1, dy - 1);
        const float top = a + (b - a) * s, bottom = c + (d - c) * s;
        float value = (top + (bottom - top) * t) * (1.0f / TS_NOISE_DEVIATION / 32767.5f);
        if (folded) value = (0.798f - fabsf(value)) * (1 / 0.603f);
        out[i] += amplitude * value;
    }
}

static float unit(uint32_t h) { return (float)(h >> 8) * 0x1p-24f; }

static void cell(int n, const float *u, const float *v, ts_noise_cells c, float *near, float *edge, float *id,
                 float *x_out, float *y_out)
{
    for (int i = 0; i < n; i++) {
        const float x = u[i] * c.frequency, y = v[i] * c.frequency;
        const int32_t column = (int32_t)floorf(x), row = (int32_t)floorf(y);
        float best[2] = {1e9f, 1e9f}, at[2][2] = {{0}};
        uint32_t key = 0;
        for (int oy = -1; oy <= 1; oy++)
            for (int ox = -1; ox <= 1; ox++) {
                const uint32_t h = ts_noise_hash(column + ox, row + oy, c.seed);
                const float half = c.stagger * 0.5f, shift = (row + oy) & 1 && c.stagger != 0 ? half : -half;
                const float px = (float)ox + shift + 0.5f + c.jitter * (unit(h) - 0.5f) - (x - (float)column);
                const float py = (float)oy + 0.5f + c.jitter * (unit(h * 0x9e3779b1u) - 0.5f) - (y - (float)row);
                const float d = px * px + py * py;
                if (d < best[0]) {
                    best[1] = best[0], at[1][0] = at[0][0], at[1][1] = at[0][1];
                    best[0] = d, at[0][0] = px, at[0][1] = py;
                    key = h;
                } else if (d < best[1]) best[1] = d, at[1][0] = px, at[1][1] = py;
            }
        const float ex = at[1][0] - at[0][0], ey = at[1][1] - at[0][1], length = sqrtf(ex * ex + ey * ey) + 1e-6f;
        if (near) near[i] = sqrtf(best[0]);
        if (edge) edge[i] = (0.5f * (at[0][0] + at[1][0]) * ex + 0.5f * (at[0][1] + at[1][1]) * ey) / length;
        if (id) id[i] = unit(key * 0x85ebca6bu);
        if (x_out) x_out[i] = -at[0][0];
        if (y_out) y_out[i] = -at[0][1];
    }
}

static void normal(int64_t blocks, const uint32_t key[2], const uint32_t counter[4], float *out)
{
    ts_rng r = {.key = {key[0], key[1]}, .counter = {counter[0], counter[1], counter[2], counter[3]}};
    for (int64_t i = 0; i < 2 * blocks; i++) out[i] = ts_rng_normal(&r);
}

const struct ts_noise_kernels ts_noise_naive = {.octave = octave, .cell = cell, .normal = normal};
