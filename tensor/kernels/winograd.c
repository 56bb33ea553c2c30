/* See winograd.h. Each transform works along one side, then along the other. */
#include "tensor/kernels/winograd.h"
#include "tensor/kernels/vec.h"

#define INLINE static inline __attribute__((always_inline))
#define UNROLL _Pragma("GCC unroll 6")

/* to = B' d */
INLINE void six(const vf d[6], vf to[6])
{
    const vf four = v_set(4), five = v_set(5), two = v_set(2);
    const vf a = d[4] - four * d[2], b = d[3] - four * d[1], c = d[4] - d[2], e = two * (d[3] - d[1]);
    to[0] = four * d[0] - five * d[2] + d[4];
    to[1] = a + b;
    to[2] = a - b;
    to[3] = c + e;
    to[4] = c - e;
    to[5] = four * d[1] - five * d[3] + d[5];
}

/* to = A' m */
INLINE void four(const vf m[6], vf to[4])
{
    const vf a = m[1] + m[2], b = m[1] - m[2], c = m[3] + m[4], d = m[3] - m[4];
    to[0] = m[0] + a + c;
    to[1] = b + v_set(2) * d;
    to[2] = a + v_set(4) * c;
    to[3] = b + v_set(8) * d + m[5];
}

static void input(const float *const pixel[36], const float *const next[36], int channels, float *v, ptrdiff_t plane)
{
    for (int c = 0; c < channels; c += VL) {
        vf half[6][6]; /* [column][row of B' d] */
        UNROLL for (int j = 0; j < 6; j++) {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(pixel[6 * i + j] + c, channels - c);
            /* The two left columns are the right ones of this tile, as a rule. */
            if (j >= 2)
                UNROLL for (int i = 0; i < 6; i++) __builtin_prefetch(next[6 * i + j] + c);
            six(d, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++) {
            vf d[6], to[6];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            six(d, to);
            UNROLL for (int j = 0; j < 6; j++) v_store_part(v + (6 * i + j) * plane + c, to[j], channels - c);
        }
    }
}

static void output(const float *m, ptrdiff_t plane, int channels, const float *bias, float leak, float *const y[16], float *const next[16])
{
    for (int c = 0; c < channels; c += VL) {
        vf half[6][4];
        const vf init = bias ? v_load_part(bias + c, channels - c) : (vf){0};
        UNROLL for (int j = 0; j < 6; j++) {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(m + (6 * i + j) * plane + c, channels - c);
            four(d, half[j]);
        }
        UNROLL for (int i = 0; i < 4; i++) {
            vf d[6], to[4];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            four(d, to);
            UNROLL for (int j = 0; j < 4; j++) {
                const vf u = to[j] + init;
                if (next[4 * i + j]) __builtin_prefetch(next[4 * i + j] + c, 1);
                if (y[4 * i + j]) v_store_part(y[4 * i + j] + c, v_max(v_set(leak) * u, u), channels - c);
            }
        }
    }
}

const struct ts_winograd_kernels TS_TABLE(winograd) = {.input = input, .output = output};
