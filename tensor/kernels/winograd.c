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
        UNROLL for (int j = 0; j < 6; j++)
        {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(pixel[6 * i + j] + c, channels - c);
            /* The two left columns are the right ones of this tile, as a rule. */
            if (j >= 2) UNROLL for (int i = 0; i < 6; i++) __builtin_prefetch(next[6 * i + j] + c);
            six(d, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf d[6], to[6];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            six(d, to);
            UNROLL for (int j = 0; j < 6; j++) v_store_part(v + (6 * i + j) * plane + c, to[j], channels - c);
        }
    }
}

static void output(const float *m, ptrdiff_t plane, int channels, const float *bias, float leak, bool add,
                   float *const y[16], float *const next[16])
{
    for (int c = 0; c < channels; c += VL) {
        vf half[6][4];
        const vf init = bias ? v_load_part(bias + c, channels - c) : (vf){0};
        UNROLL for (int j = 0; j < 6; j++)
        {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(m + (6 * i + j) * plane + c, channels - c);
            four(d, half[j]);
        }
        UNROLL for (int i = 0; i < 4; i++)
        {
            vf d[6], to[4];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            four(d, to);
            UNROLL for (int j = 0; j < 4; j++)
            {
                if (next[4 * i + j]) __builtin_prefetch(next[4 * i + j] + c, 1);
                if (!y[4 * i + j]) continue;
                const vf u = add ? to[j] + init + v_load_part(y[4 * i + j] + c, channels - c) : to[j] + init;
                v_store_part(y[4 * i + j] + c, v_max(v_set(leak) * u, u), channels - c);
            }
        }
    }
}

/* to = G w */
INLINE void from_three(const vf w[3], vf to[6])
{
    const vf a = v_set(1.0f / 6) * (w[0] + w[2]), b = v_set(1.0f / 6) * w[1],
             c = v_set(1.0f / 24) * w[0] + v_set(1.0f / 6) * w[2], d = v_set(1.0f / 12) * w[1];
    to[0] = v_set(0.25f) * w[0];
    to[1] = -(a + b);
    to[2] = b - a;
    to[3] = c + d;
    to[4] = c - d;
    to[5] = w[2];
}

static void weights(const float *tap, int vectors, float *u, ptrdiff_t plane)
{
    for (int o = 0; o < vectors * VL; o += VL) {
        vf half[3][6]; /* [column][row of G g] */
        UNROLL for (int j = 0; j < 3; j++)
        {
            vf w[3];
            UNROLL for (int i = 0; i < 3; i++) w[i] = v_load(tap + (3 * i + j) * vectors * VL + o);
            from_three(w, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf w[3], to[6];
            UNROLL for (int j = 0; j < 3; j++) w[j] = half[j][i];
            from_three(w, to);
            UNROLL for (int j = 0; j < 6; j++) v_store(u + (6 * i + j) * plane + o, to[j]);
        }
    }
}

/* to = A y */
INLINE void from_four(const vf y[4], vf to[6])
{
    const vf a = y[0] + y[2], b = y[1] + y[3], c = y[0] + v_set(4) * y[2], d = v_set(2) * y[1] + v_set(8) * y[3];
    to[0] = y[0];
    to[1] = a + b;
    to[2] = a - b;
    to[3] = c + d;
    to[4] = c - d;
    to[5] = y[3];
}

static void output_gradient(const float *const dy[16], const float *const next[16], int channels, float *m,
                            ptrdiff_t plane)
{
    for (int c = 0; c < channels; c += VL) {
        vf half[4][6]; /* [column][row of A dy] */
        UNROLL for (int j = 0; j < 4; j++)
        {
            vf d[4];
            UNROLL for (int i = 0; i < 4; i++)
            {
                d[i] = v_load_part(dy[4 * i + j] + c, channels - c);
                __builtin_prefetch(next[4 * i + j] + c);
            }
            from_four(d, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf d[4], to[6];
            UNROLL for (int j = 0; j < 4; j++) d[j] = half[j][i];
            from_four(d, to);
            UNROLL for (int j = 0; j < 6; j++) v_store(m + (6 * i + j) * plane + c, to[j]);
        }
    }
}

/* to = G' u */
INLINE void three(const vf u[6], vf to[3])
{
    const vf a = u[1] + u[2], b = u[2] - u[1], c = u[3] + u[4], d = u[3] - u[4];
    to[0] = v_set(0.25f) * u[0] - v_set(1.0f / 6) * a + v_set(1.0f / 24) * c;
    to[1] = v_set(1.0f / 6) * b + v_set(1.0f / 12) * d;
    to[2] = v_set(1.0f / 6) * (c - a) + u[5];
}

static void weights_gradient(const float *u, ptrdiff_t plane, int sums, ptrdiff_t sum, float *tap)
{
    vf half[6][3]; /* [column][row of G' u] */
    UNROLL for (int j = 0; j < 6; j++)
    {
        vf d[6];
        UNROLL for (int i = 0; i < 6; i++)
        {
            d[i] = v_load(u + (6 * i + j) * plane);
            for (int s = 1; s < sums; s++) d[i] += v_load(u + s * sum + (6 * i + j) * plane);
        }
        three(d, half[j]);
    }
    UNROLL for (int i = 0; i < 3; i++)
    {
        vf d[6], to[3];
        UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
        three(d, to);
        UNROLL for (int j = 0; j < 3; j++) v_store(tap + (3 * i + j) * VL, to[j]);
    }
}

const struct ts_winograd_kernels TS_TABLE(winograd) = {.input = input,
                                                       .output = output,
                                                       .weights = weights,
                                                       .output_gradient = output_gradient,
                                                       .weights_gradient = weights_gradient};
