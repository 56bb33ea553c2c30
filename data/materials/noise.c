#include "data/materials/noise.h"
#include <stdbool.h>
#include <stddef.h>

/* Points that all octaves are summed at before the next ones: they and the sum stay in the first cache. */
enum { BLOCK = 1024 };

void nz_fbm(nz_frame f, nz_kind kind, float frequency, int octaves, float gain, uint32_t seed, float *out)
{
    float power = 0, amplitude = 1;
    for (int k = 0; k < octaves; k++, amplitude *= gain) power += amplitude * amplitude;
    float root = power; /* Newton: no libm */
    for (int k = 0; k < 12; k++) root = 0.5f * (root + power / root);
    amplitude = 1 / root;
    for (int begin = 0; begin < f.count; begin += BLOCK) {
        const int n = f.count - begin < BLOCK ? f.count - begin : BLOCK;
        float a = amplitude, cycles = frequency;
        for (int i = 0; i < n; i++) out[begin + i] = 0;
        for (int k = 0; k < octaves; k++, a *= gain, cycles *= 2) {
            float seen = nz_smooth(0.62f, 0.3f + 1e-6f,
                                   cycles * f.step); /* gradient noise has its energy near one cycle per unit */
            if (seen <= 0) break;
            uint32_t s = seed + 101u * (uint32_t)k;
            float shift_u = nz_unit(nz_hash(1, 0, s)) * 64, shift_v = nz_unit(nz_hash(2, 0, s)) * 64;
            float scale = kind == NZ_BILLOW ? -a * seen : a * seen;
            ts_noise_k()->octave(n, f.u + begin, f.v + begin, cycles, shift_u, shift_v, s, kind != NZ_SMOOTH, scale,
                                 out + begin);
        }
    }
}

void nz_cell(nz_frame f, float frequency, float jitter, float stagger, uint32_t seed, nz_cells out)
{
    ts_noise_k()->cell(f.count, f.u, f.v, (ts_noise_cells){frequency, jitter, stagger, seed}, out.near, out.edge,
                       out.id, out.x, out.y);
}

static inline float root_of(float x) /* sqrt for x >= 0; the builtin is one correctly rounded instruction */
{
    return __builtin_sqrtf(x);
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
        float u = f.u[i] / shape.width + row * shape.shift + shape.loose * nz_unit(nz_hash((int32_t)row, 0, seed)),
              column = nz_floor(u);
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

/* Along LINES rows at once with a running sum for each, writing the result transposed: two calls blur both ways. */
static inline __attribute__((always_inline)) void box_rows(int size, int rows, int radius, const float *in, float *out)
{
    enum { LINES = 16 };
    float scale = 1.0f / (float)(2 * radius + 1), sum[LINES];
    const size_t stride = (size_t)size;
    for (int k = 0; k < rows; k++) {
        const float *row = in + (size_t)k * stride;
        sum[k] = (float)(radius + 1) * row[0];
        for (int t = 1; t <= radius; t++) sum[k] += row[t < size ? t : size - 1];
    }
    for (int x = 0; x < size; x++) {
        int enter = x + radius + 1, leave = x - radius;
        const float *add = in + (enter < size ? enter : size - 1), *drop = in + (leave > 0 ? leave : 0);
        float *to = out + (size_t)x * stride;
        for (int k = 0; k < rows; k++) {
            to[k] = sum[k] * scale;
            sum[k] += add[(size_t)k * stride] - drop[(size_t)k * stride];
        }
    }
}

static void box_transposed(int size, int radius, const float *in, float *out)
{
    for (int y = 0; y < size; y += 16) {
        const int rows = size - y < 16 ? size - y : 16;
        if (rows == 16)
            box_rows(size, 16, radius, in + (size_t)y * (size_t)size, out + y); /* a constant count is unrolled */
        else box_rows(size, rows, radius, in + (size_t)y * (size_t)size, out + y);
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
