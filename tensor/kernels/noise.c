/* Loops without branches over arrays, which the compiler turns into vectors of whatever width the instruction set has.
 */
#include "tensor/kernels/noise.h"
#include "tensor/kernels/vmath.h"

enum { BLOCK = 256 };

static inline float floor_of(float x)
{
    float t = (float)(int32_t)x;
    return t > x ? t - 1 : t;
}

static inline float unit(uint32_t h) { return (float)(int32_t)(h >> 8) * (1.0f / 16777216.0f); }

static inline float mix(float a, float b, float t) { return a + (b - a) * t; }

static inline float corner(uint32_t key, float dx, float dy)
{
    key ^= key >> 15; /* one round is enough: the lattice numbers come in multiplied */
    key *= 0x2c1b3c6du;
    key ^= key >> 13;
    return ((float)(int32_t)(key & 0xffff) - 32767.5f) * dx + ((float)(int32_t)(key >> 16) - 32767.5f) * dy;
}

static inline __attribute__((always_inline)) void sum(int n, const float *u, const float *v, float frequency,
                                                      float shift_u, float shift_v, uint32_t seed, bool folded,
                                                      float amplitude, float *restrict out)
{
    for (int i = 0; i < n; i++) {
        float x = u[i] * frequency + shift_u, y = v[i] * frequency + shift_v;
        float xf = floor_of(x), yf = floor_of(y), dx = x - xf, dy = y - yf;
        uint32_t k = (uint32_t)(int32_t)xf * 0x8da6b343u + (uint32_t)(int32_t)yf * 0xd8163841u + seed * 0xcb1ab31fu;
        float a = corner(k, dx, dy), b = corner(k + 0x8da6b343u, dx - 1, dy);
        float c = corner(k + 0xd8163841u, dx, dy - 1), d = corner(k + 0x8da6b343u + 0xd8163841u, dx - 1, dy - 1);
        float s = dx * dx * dx * (dx * (dx * 6 - 15) + 10), t = dy * dy * dy * (dy * (dy * 6 - 15) + 10);
        float value = mix(mix(a, b, s), mix(c, d, s), t) * (1.0f / TS_NOISE_DEVIATION / 32767.5f);
        if (folded) value = (0.798f - (value < 0 ? -value : value)) * (1 / 0.603f);
        out[i] += amplitude * value;
    }
}

static void octave(int n, const float *u, const float *v, float frequency, float shift_u, float shift_v, uint32_t seed,
                   bool folded, float amplitude, float *out)
{
    if (folded) sum(n, u, v, frequency, shift_u, shift_v, seed, true, amplitude, out);
    else sum(n, u, v, frequency, shift_u, shift_v, seed, false, amplitude, out);
}

static void cell(int count, const float *u, const float *v, ts_noise_cells c, float *near, float *edge, float *id,
                 float *x_out, float *y_out)
{
    float first[BLOCK], second[BLOCK], ax[BLOCK], ay[BLOCK], bx[BLOCK], by[BLOCK], lx[BLOCK], ly[BLOCK];
    int32_t cx[BLOCK], cy[BLOCK];
    uint32_t key[BLOCK];
    for (int begin = 0; begin < count; begin += BLOCK, u += BLOCK, v += BLOCK) {
        int n = count - begin < BLOCK ? count - begin : BLOCK;
        for (int i = 0; i < n; i++) {
            float y = v[i] * c.frequency, yf = floor_of(y);
            float x = u[i] * c.frequency, xf = floor_of(x);
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
                uint32_t h = ts_noise_hash(cx[i] + ox, row, c.seed), h2 = h * 0x9e3779b1u;
                float odd = (row & 1) ? c.stagger : 0.0f;
                float px = (float)ox + odd * 0.5f - (1 - (odd != 0)) * c.stagger * 0.5f + 0.5f +
                    c.jitter * (unit(h) - 0.5f) - lx[i];
                float py = (float)oy + 0.5f + c.jitter * (unit(h2) - 0.5f) - ly[i];
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
            float ex = bx[i] - ax[i], ey = by[i] - ay[i],
                  length = __builtin_sqrtf(ex * ex + ey * ey) + 1e-6f; /* two points may coincide */
            if (near) near[begin + i] = __builtin_sqrtf(first[i]);
            if (edge) edge[begin + i] = (0.5f * (ax[i] + bx[i]) * ex + 0.5f * (ay[i] + by[i]) * ey) / length;
            if (id) id[begin + i] = unit(key[i] * 0x85ebca6bu);
            if (x_out) x_out[begin + i] = -ax[i];
            if (y_out) y_out[begin + i] = -ay[i];
        }
    }
}

/* cos(2 pi x), 0 <= x < 1: its Taylor series on a quarter of a turn, 1e-7 */
static inline vf cos_turns(vf x)
{
    const vf a = v_abs(x - 0.5f), folded = v_min(a, 0.5f - a),
             t = folded * folded; /* cos(2 pi x) = -cos(2 pi |x - 1/2|) */
    vf p = v_set(7.9035364f);
    p = p * t - 26.426257f;
    p = p * t + 60.244641f;
    p = p * t - 85.456817f;
    p = p * t + 64.939394f;
    p = p * t - 19.739209f;
    p = p * t + 1.0f;
    return v_select(a < v_set(0.25f), -p, p);
}

static inline vf to_float(const uint32_t *w)
{
    vf x;
    for (int i = 0; i < VL; i++) x[i] = (float)w[i];
    return x;
}

static void normal(int64_t blocks, const uint32_t key[2], const uint32_t counter[4], float *out)
{
    enum { N = 64 };
    uint32_t c0[N], c1[N], c2[N], c3[N];
    float first[N], second[N];
    for (int64_t begin = 0; begin < blocks; begin += N, out += 2 * N) {
        const int n = blocks - begin < N ? (int)(blocks - begin) : N;
        for (int i = 0; i < N; i++) {
            c0[i] = counter[0] + (uint32_t)begin + (uint32_t)i;
            c1[i] = counter[1];
            c2[i] = counter[2];
            c3[i] = counter[3];
        }
        uint32_t k0 = key[0], k1 = key[1];
        for (int round = 0; round < 10; round++, k0 += 0x9E3779B9u, k1 += 0xBB67AE85u)
            for (int i = 0; i < N; i++) {
                const uint64_t p0 = (uint64_t)0xD2511F53u * c0[i], p1 = (uint64_t)0xCD9E8D57u * c2[i];
                c0[i] = (uint32_t)(p1 >> 32) ^ c1[i] ^ k0;
                c2[i] = (uint32_t)(p0 >> 32) ^ c3[i] ^ k1;
                c1[i] = (uint32_t)p1;
                c3[i] = (uint32_t)p0;
            }
        for (int i = 0; i < N; i += VL) {
            const vf u = (to_float(c0 + i) + 1.0f) * 0x1p-32f, v = (to_float(c2 + i) + 1.0f) * 0x1p-32f;
            v_store(first + i, v_sqrt(-2.0f * v_log(u)) * cos_turns(to_float(c1 + i) * 0x1p-32f));
            v_store(second + i, v_sqrt(-2.0f * v_log(v)) * cos_turns(to_float(c3 + i) * 0x1p-32f));
        }
        for (int i = 0; i < n; i++) {
            out[2 * i] = first[i];
            out[2 * i + 1] = second[i];
        }
    }
}

const struct ts_noise_kernels TS_TABLE(noise) = {.octave = octave, .cell = cell, .normal = normal};
