#include "data/noise.h"
#include <stdbool.h>
#include <stddef.h>

/* Gradient noise of unit lattice has this standard deviation with gradients uniform in the square [-1, 1]^2 (measured). */
#define NOISE_SCALE (1.0f / 0.1762f)
#define BLOCK 256

/* The standard deviation of |x| for a normal x is 0.603, its mean 0.798. */
static inline float shaped(nz_kind kind, float x)
{
    if (kind == NZ_SMOOTH) return x;
    float y = (0.798f - nz_abs(x)) * (1 / 0.603f);
    return kind == NZ_RIDGED ? y : -y;
}

static inline float corner(uint32_t key, float dx, float dy)
{
    key ^= key >> 15; /* one round is enough: the lattice numbers come in multiplied */
    key *= 0x2c1b3c6du;
    key ^= key >> 13;
    return ((float)(int32_t)(key & 0xffff) - 32767.5f) * dx + ((float)(int32_t)(key >> 16) - 32767.5f) * dy;
}

/* One octave: the quintic fade and four gradients at the lattice points around. */
static inline __attribute__((always_inline)) void octave(nz_frame f, nz_kind kind, float frequency, uint32_t seed, float amplitude, float *out)
{
    float shift_u = nz_unit(nz_hash(1, 0, seed)) * 64, shift_v = nz_unit(nz_hash(2, 0, seed)) * 64;
    const float *u = f.u, *v = f.v;
    for (int i = 0; i < f.count; i++) {
        float x = u[i] * frequency + shift_u, y = v[i] * frequency + shift_v;
        float xf = nz_floor(x), yf = nz_floor(y), dx = x - xf, dy = y - yf;
        uint32_t k = (uint32_t)(int32_t)xf * 0x8da6b343u + (uint32_t)(int32_t)yf * 0xd8163841u + seed * 0xcb1ab31fu;
        float a = corner(k, dx, dy), b = corner(k + 0x8da6b343u, dx - 1, dy);
        float c = corner(k + 0xd8163841u, dx, dy - 1), d = corner(k + 0x8da6b343u + 0xd8163841u, dx - 1, dy - 1);
        float s = dx * dx * dx * (dx * (dx * 6 - 15) + 10), t = dy * dy * dy * (dy * (dy * 6 - 15) + 10);
        float value = nz_mix(nz_mix(a, b, s), nz_mix(c, d, s), t) * (NOISE_SCALE / 32767.5f);
        out[i] += amplitude * shaped(kind, value);
    }
}

static void octave_smooth(nz_frame f, float frequency, uint32_t seed, float amplitude, float *restrict out)
{
    octave(f, NZ_SMOOTH, frequency, seed, amplitude, out);
}

static void octave_ridged(nz_frame f, float frequency, uint32_t seed, float amplitude, float *restrict out)
{
    octave(f, NZ_RIDGED, frequency, seed, amplitude, out);
}

void nz_fbm(nz_frame f, nz_kind kind, float frequency, int octaves, float gain, uint32_t seed, float *out)
{
    float power = 0, amplitude = 1;
    for (int k = 0; k < octaves; k++, amplitude *= gain) power += amplitude * amplitude;
    float root = power; /* Newton: no libm */
    for (int k = 0; k < 12; k++) root = 0.5f * (root + power / root);
    for (int i = 0; i < f.count; i++) out[i] = 0;
    amplitude = 1 / root;
    for (int k = 0; k < octaves; k++, amplitude *= gain, frequency *= 2) {
        float seen = nz_smooth(0.62f, 0.3f + 1e-6f, frequency * f.step); /* gradient noise has its energy near one cycle per unit */
        if (seen <= 0) break;
        if (kind == NZ_SMOOTH) octave_smooth(f, frequency, seed + 101u * (uint32_t)k, amplitude * seen, out);
        else octave_ridged(f, frequency, seed + 101u * (uint32_t)k, kind == NZ_RIDGED ? amplitude * seen : -amplitude * seen, out);
    }
}

static inline float root_of(float x) /* sqrt for x >= 0; the builtin is one correctly rounded instruction */ { return __builtin_sqrtf(x); }

void nz_cell(nz_frame f, float frequency, float jitter, float stagger, uint32_t seed, nz_cells out)
{
    float first[BLOCK], second[BLOCK], ax[BLOCK], ay[BLOCK], bx[BLOCK], by[BLOCK], lx[BLOCK], ly[BLOCK];
    int32_t cx[BLOCK], cy[BLOCK];
    uint32_t key[BLOCK];
    for (int begin = 0; begin < f.count; begin += BLOCK) {
        int n = f.count - begin < BLOCK ? f.count - begin : BLOCK;
        const float *u = f.u + begin, *v = f.v + begin;
        for (int i = 0; i < n; i++) {
            float y = v[i] * frequency, yf = nz_floor(y);
            float x = u[i] * frequency, xf = nz_floor(x);
            cx[i] = (int32_t)xf;
            cy[i] = (int32_t)yf;
            lx[i] = x - xf;
            ly[i] = y - yf;
            first[i] = second[i] = 1e9f;
            ax[i] = ay[i] = bx[i] = by[i] = 0;
            key[i] = 0;
        }
        for (int k = 0; k < 9; k++) {
            int ox = k % 3 - 1, oy = k / 3 - 1;
            for (int i = 0; i < n; i++) {
                int32_t row = cy[i] + oy;
                uint32_t h = nz_hash(cx[i] + ox, row, seed), h2 = h * 0x9e3779b1u;
                float odd = (row & 1) ? stagger : 0.0f;
                float px = (float)ox + odd * 0.5f - (1 - (odd != 0)) * stagger * 0.5f + 0.5f + jitter * (nz_unit(h) - 0.5f) - lx[i];
                float py = (float)oy + 0.5f + jitter * (nz_unit(h2) - 0.5f) - ly[i];
                float d = px * px + py * py;
                int closest = d < first[i], next = d < second[i];
                second[i] = closest ? first[i] : next ? d : second[i];
                bx[i] = closest ? ax[i] : next ? px : bx[i];
                by[i] = closest ? ay[i] : next ? py : by[i];
                first[i] = closest ? d : first[i];
                ax[i] = closest ? px : ax[i];
                ay[i] = closest ? py : ay[i];
                key[i] = closest ? h : key[i];
            }
        }
        for (int i = 0; i < n; i++) {
            float ex = bx[i] - ax[i], ey = by[i] - ay[i], length = root_of(ex * ex + ey * ey) + 1e-6f; /* two points may coincide */
            if (out.near) out.near[begin + i] = root_of(first[i]);
            if (out.edge) out.edge[begin + i] = (0.5f * (ax[i] + bx[i]) * ex + 0.5f * (ay[i] + by[i]) * ey) / length;
            if (out.id) out.id[begin + i] = nz_unit(key[i] * 0x85ebca6bu);
            if (out.x) out.x[begin + i] = -ax[i];
            if (out.y) out.y[begin + i] = -ay[i];
        }
    }
}

/* Distance to the border of a rectangle of half sizes w, h with rounded corners, positive inside. */
static inline float rectangle(float x, float y, float w, float h, float round)
{
    float r = nz_min(round, 0.98f * nz_min(w, h)), qx = nz_abs(x) - w + r, qy = nz_abs(y) - h + r;
    float ox = nz_max(qx, 0), oy = nz_max(qy, 0);
    return r - root_of(ox * ox + oy * oy) - nz_min(nz_max(qx, qy), 0);
}

void nz_brick(nz_frame f, nz_brick_shape shape, uint32_t seed, nz_cells out)
{
    for (int i = 0; i < f.count; i++) {
        float row = nz_floor(f.v[i]), y = f.v[i] - row - 0.5f;
        float u = f.u[i] / shape.width + row * shape.shift + shape.loose * nz_unit(nz_hash((int32_t)row, 0, seed)), column = nz_floor(u);
        float x = (u - column - 0.5f) * shape.width;
        if (out.edge) out.edge[i] = rectangle(x, y, 0.5f * shape.width, 0.5f, shape.round);
        if (out.id) out.id[i] = nz_unit(nz_hash((int32_t)column, (int32_t)row, seed + 1));
        if (out.x) out.x[i] = x;
        if (out.y) out.y[i] = y;
    }
}

void nz_herringbone(nz_frame f, int length, float round, uint32_t seed, nz_cells out)
{
    int period = 2 * length;
    for (int i = 0; i < f.count; i++) {
        /* Going right along a row: length squares of a lying block, then one square each of length standing ones. */
        int column = (int)nz_floor(f.u[i]), row = (int)nz_floor(f.v[i]), step = (column - row) % period;
        if (step < 0) step += period;
        bool lying = step < length;
        int from = lying ? step : period - 1 - step; /* squares from the block's beginning */
        int x0 = lying ? column - from : column, y0 = lying ? row : row - from;
        float along = (lying ? f.u[i] - (float)x0 : f.v[i] - (float)y0) - 0.5f * (float)length,
              across = (lying ? f.v[i] - (float)y0 : f.u[i] - (float)x0) - 0.5f;
        if (out.edge) out.edge[i] = rectangle(along, across, 0.5f * (float)length, 0.5f, round);
        if (out.id) out.id[i] = nz_unit(nz_hash(x0, y0, seed + lying));
        if (out.x) out.x[i] = along;
        if (out.y) out.y[i] = across;
    }
}

/* Down the columns with a running sum per column, writing the result transposed: two calls blur both ways. */
static void box_transposed(int size, int radius, const float *in, float *out)
{
    float scale = 1.0f / (float)(2 * radius + 1);
    for (int y = 0; y < size; y++) {
        const float *row = in + (size_t)y * (size_t)size;
        float sum = (float)(radius + 1) * row[0];
        for (int k = 1; k <= radius; k++) sum += row[k < size ? k : size - 1];
        for (int x = 0; x < size; x++) {
            out[(size_t)x * (size_t)size + (size_t)y] = sum * scale;
            int enter = x + radius + 1, leave = x - radius;
            sum += row[enter < size ? enter : size - 1] - row[leave > 0 ? leave : 0];
        }
    }
}

void nz_blur(int size, int radius, const float *in, float *out, float *work)
{
    if (radius < 1) {
        for (int i = 0; i < size * size; i++) out[i] = in[i];
        return;
    }
    box_transposed(size, radius, in, work);
    box_transposed(size, radius, work, out);
    for (int pass = 0; pass < 2; pass++) {
        box_transposed(size, radius, out, work);
        box_transposed(size, radius, work, out);
    }
}
