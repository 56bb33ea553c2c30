/* See winograd.h. Each transform works along one side, then along the other. */
#include "tensor/kernels/winograd.h"
#include "tensor/kernels/vec.h"

#define INLINE static inline __attribute__((always_inline))
#define UNROLL _Pragma("GCC unroll 6")

/* Polynomials are multiplied at 0, p, -p, q, -q and infinity. The functions below are inlined with constants: where p
 * is 1 nothing is left of a product with it. */
typedef struct points {
    double p, q;
} points;
INLINE points points_of(ts_winograd_form form)
{
    return form == TS_WINOGRAD_F32 ? (points){1, 2} : (points){0.6875, 1.5};
}
#define POINTS const double p = at.p, q = at.q, p2 = p * p, q2 = q * q
#define SET(x) v_set((float)(x))

/* to = B' d */
INLINE void six(points at, const vf d[6], vf to[6])
{
    POINTS;
    const vf a = d[4] - SET(q2) * d[2], b = SET(p) * (d[3] - SET(q2) * d[1]), c = d[4] - SET(p2) * d[2],
             e = SET(q) * (d[3] - SET(p2) * d[1]);
    to[0] = SET(p2 * q2) * d[0] - SET(p2 + q2) * d[2] + d[4];
    to[1] = a + b;
    to[2] = a - b;
    to[3] = c + e;
    to[4] = c - e;
    to[5] = SET(p2 * q2) * d[1] - SET(p2 + q2) * d[3] + d[5];
}

/* to = A' m of kernels of side 5, which make a tile of side 2 */
INLINE void two(points at, const vf m[6], vf to[4])
{
    to[0] = m[0] + (m[1] + m[2]) + (m[3] + m[4]);
    to[1] = SET(at.p) * (m[1] - m[2]) + SET(at.q) * (m[3] - m[4]) + m[5];
}

/* The same of side 3, which make one of side 4 */
INLINE void four(points at, const vf m[6], vf to[4])
{
    POINTS;
    const vf a = m[1] + m[2], b = m[1] - m[2], c = m[3] + m[4], d = m[3] - m[4];
    to[0] = m[0] + a + c;
    to[1] = SET(p) * b + SET(q) * d;
    to[2] = SET(p2) * a + SET(q2) * c;
    to[3] = SET(p2 * p) * b + SET(q2 * q) * d + m[5];
}

/* x, or its first values, as the float, or in the halves of floats that form names. */
INLINE void put(ts_winograd_form form, float *to, vf x, int64_t left)
{
    if (form == TS_WINOGRAD_F32) {
        v_store_part(to, x, left);
        return;
    }
    if (form == TS_WINOGRAD_CHANNELS) {
        const vu16 rounded = v_bf16_half(x);
        if (left >= VL) memcpy(to, &rounded, sizeof rounded);
#if defined(__AVX512VL__)
        else _mm256_mask_storeu_epi32(to, (__mmask8)((1u << (left + 1) / 2) - 1), (__m256i)rounded);
#else
        else memcpy(to, &rounded, (size_t)((left + 1) / 2) * sizeof *to);
#endif
        return;
    }
    const vu rounded = __builtin_convertvector(v_bf16_half(x), vu);
    if (form == TS_WINOGRAD_EVEN) v_store_part(to, (vf)rounded, left);
    else v_store_part(to, (vf)((vu)v_load_part(to, left) | rounded << 16), left);
}

INLINE void input(const ts_winograd_form form, const float *const pixel[36], const float *const next[36], int channels,
                  float *v, ptrdiff_t plane)
{
    const points at = points_of(form);
    for (int c = 0; c < channels; c += VL, v += form == TS_WINOGRAD_CHANNELS ? VL / 2 : VL) {
        vf half[6][6]; /* [column][row of B' d] */
        UNROLL for (int j = 0; j < 6; j++)
        {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(pixel[6 * i + j] + c, channels - c);
            /* The two left columns are the right ones of this tile, as a rule. */
            if (j >= 2) UNROLL for (int i = 0; i < 6; i++) __builtin_prefetch(next[6 * i + j] + c);
            six(at, d, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf d[6], to[6];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            six(at, d, to);
            UNROLL for (int j = 0; j < 6; j++) put(form, v + (6 * i + j) * plane, to[j], channels - c);
        }
    }
}

/* side: of the tile of outputs. */
INLINE void output(const ts_winograd_form form, const int side, const float *m, ptrdiff_t plane, int channels,
                   const float *bias, const float *base, float leak, float *y, const ptrdiff_t *to_y,
                   const ptrdiff_t *next)
{
    const points at = points_of(form);
    void (*const make)(points, const vf *, vf *) = side == 4 ? four : two;
    for (int c = 0; c < channels; c += VL) {
        vf half[6][4];
        const vf init = bias ? v_load_part(bias + c, channels - c) : (vf){0};
        UNROLL for (int j = 0; j < 6; j++)
        {
            vf d[6];
            UNROLL for (int i = 0; i < 6; i++) d[i] = v_load_part(m + (6 * i + j) * plane + c, channels - c);
            make(at, d, half[j]);
        }
        UNROLL for (int i = 0; i < side; i++)
        {
            vf d[6], to[4];
            UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
            make(at, d, to);
            UNROLL for (int j = 0; j < side; j++)
            {
                const int k = side * i + j;
                if (next[k] >= 0) __builtin_prefetch(y + next[k] + c, 1);
                if (to_y[k] < 0) continue;
                const vf u = base ? to[j] + init + v_load_part(base + to_y[k] + c, channels - c) : to[j] + init;
                v_store_part(y + to_y[k] + c, v_max(v_set(leak) * u, u), channels - c);
            }
        }
    }
}

/* At 0, p, -p, q, -q and infinity, from the even and odd part at p and at q. */
INLINE void at_points(points at, vf first, vf a, vf b, vf c, vf d, vf last, vf to[6])
{
    POINTS;
    to[0] = SET(1 / (p2 * q2)) * first;
    to[1] = -(a + b);
    to[2] = b - a;
    to[3] = c + d;
    to[4] = c - d;
    to[5] = last;
}

/* to = G w of a kernel of side 5 */
INLINE void from_five(points at, const vf *w, vf to[6])
{
    POINTS;
    const double at_p = 1 / (2 * p2 * (q2 - p2)), at_q = 1 / (2 * q2 * (q2 - p2));
    const vf a = SET(at_p) * (w[0] + SET(p2) * w[2] + SET(p2 * p2) * w[4]), b = SET(p * at_p) * (w[1] + SET(p2) * w[3]),
             c = SET(at_q) * (w[0] + SET(q2) * w[2] + SET(q2 * q2) * w[4]), d = SET(q * at_q) * (w[1] + SET(q2) * w[3]);
    at_points(at, w[0], a, b, c, d, w[4], to);
}

/* Of side 3 */
INLINE void from_three(points at, const vf *w, vf to[6])
{
    POINTS;
    const double at_p = 1 / (2 * p2 * (q2 - p2)), at_q = 1 / (2 * q2 * (q2 - p2)), squares = 1 / (2 * (q2 - p2));
    const vf a = SET(at_p) * (w[0] + SET(p2) * w[2]), b = SET(p * at_p) * w[1],
             c = SET(at_q) * w[0] + SET(squares) * w[2], d = SET(q * at_q) * w[1];
    at_points(at, w[0], a, b, c, d, w[2], to);
}

INLINE void weights(const ts_winograd_form form, const int side, const float *tap, ptrdiff_t step, int vectors,
                    float *u, ptrdiff_t plane)
{
    const points at = points_of(form);
    void (*const make)(points, const vf *, vf *) = side == 3 ? from_three : from_five;
    for (int o = 0; o < vectors * VL; o += VL) {
        vf half[5][6]; /* [column][row of G g] */
        UNROLL for (int j = 0; j < side; j++)
        {
            vf w[5];
            UNROLL for (int i = 0; i < side; i++) w[i] = v_load(tap + (side * i + j) * step + o);
            make(at, w, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf w[5], to[6];
            UNROLL for (int j = 0; j < side; j++) w[j] = half[j][i];
            make(at, w, to);
            UNROLL for (int j = 0; j < 6; j++) put(form, u + (6 * i + j) * plane + o, to[j], VL);
        }
    }
}

/* to = A y */
INLINE void from_four(points at, const vf y[4], vf to[6])
{
    POINTS;
    const vf a = y[0] + SET(p2) * y[2], b = SET(p) * y[1] + SET(p2 * p) * y[3], c = y[0] + SET(q2) * y[2],
             d = SET(q) * y[1] + SET(q2 * q) * y[3];
    to[0] = y[0];
    to[1] = a + b;
    to[2] = a - b;
    to[3] = c + d;
    to[4] = c - d;
    to[5] = y[3];
}

INLINE void output_gradient(const ts_winograd_form form, const float *const dy[16], const float *const next[16],
                            int channels, float *m, ptrdiff_t plane)
{
    const points at = points_of(form);
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
            from_four(at, d, half[j]);
        }
        UNROLL for (int i = 0; i < 6; i++)
        {
            vf d[4], to[6];
            UNROLL for (int j = 0; j < 4; j++) d[j] = half[j][i];
            from_four(at, d, to);
            UNROLL for (int j = 0; j < 6; j++) put(form, m + (6 * i + j) * plane + c, to[j], VL);
        }
    }
}

/* to = G' u */
INLINE void three(points at, const vf u[6], vf to[3])
{
    POINTS;
    const double at_p = 1 / (2 * p2 * (q2 - p2)), at_q = 1 / (2 * q2 * (q2 - p2)), squares = 1 / (2 * (q2 - p2));
    const vf a = u[1] + u[2], b = u[2] - u[1], c = u[3] + u[4], d = u[3] - u[4];
    to[0] = SET(1 / (p2 * q2)) * u[0] - SET(at_p) * a + SET(at_q) * c;
    to[1] = SET(p * at_p) * b + SET(q * at_q) * d;
    to[2] = SET(squares) * (c - a) + u[5];
}

INLINE void weights_gradient(const ts_winograd_form form, const float *u, ptrdiff_t plane, int sums, ptrdiff_t sum,
                             float *tap)
{
    const points at = points_of(form);
    vf half[6][3]; /* [column][row of G' u] */
    UNROLL for (int j = 0; j < 6; j++)
    {
        vf d[6];
        UNROLL for (int i = 0; i < 6; i++)
        {
            d[i] = v_load(u + (6 * i + j) * plane);
            for (int s = 1; s < sums; s++) d[i] += v_load(u + s * sum + (6 * i + j) * plane);
        }
        three(at, d, half[j]);
    }
    UNROLL for (int i = 0; i < 3; i++)
    {
        vf d[6], to[3];
        UNROLL for (int j = 0; j < 6; j++) d[j] = half[j][i];
        three(at, d, to);
        UNROLL for (int j = 0; j < 3; j++) v_store(tap + (3 * i + j) * VL, to[j]);
    }
}

#define INPUT(name, form)                                                                                       \
    static void input_##name(const float *const pixel[36], const float *const next[36], int channels, float *v, \
                             ptrdiff_t plane)                                                                   \
    {                                                                                                           \
        input(form, pixel, next, channels, v, plane);                                                           \
    }
#define WEIGHTS(name, form, side)                                                                                 \
    static void weights_##side##_##name(const float *tap, ptrdiff_t step, int vectors, float *u, ptrdiff_t plane) \
    {                                                                                                             \
        weights(form, side, tap, step, vectors, u, plane);                                                        \
    }
#define OUTPUT_GRADIENT(name, form)                                                                                    \
    static void output_gradient_##name(const float *const dy[16], const float *const next[16], int channels, float *m, \
                                       ptrdiff_t plane)                                                                \
    {                                                                                                                  \
        output_gradient(form, dy, next, channels, m, plane);                                                           \
    }
#define OUTPUT(name, form, k)                                                                         \
    static void output_##k##_##name(const float *m, ptrdiff_t plane, int channels, const float *bias, \
                                    const float *base, float leak, float *y, const ptrdiff_t *at,     \
                                    const ptrdiff_t *next)                                            \
    {                                                                                                 \
        output(form, 7 - k, m, plane, channels, bias, base, leak, y, at, next);                       \
    }
#define WEIGHTS_GRADIENT(name, form)                                                                          \
    static void weights_gradient_##name(const float *u, ptrdiff_t plane, int sums, ptrdiff_t sum, float *tap) \
    {                                                                                                         \
        weights_gradient(form, u, plane, sums, sum, tap);                                                     \
    }
INPUT(f32, TS_WINOGRAD_F32)
INPUT(channels, TS_WINOGRAD_CHANNELS)
INPUT(even, TS_WINOGRAD_EVEN)
INPUT(odd, TS_WINOGRAD_ODD)
WEIGHTS(f32, TS_WINOGRAD_F32, 3)
WEIGHTS(f32, TS_WINOGRAD_F32, 5)
WEIGHTS(even, TS_WINOGRAD_EVEN, 3)
WEIGHTS(odd, TS_WINOGRAD_ODD, 3)
OUTPUT(f32, TS_WINOGRAD_F32, 3)
OUTPUT(f32, TS_WINOGRAD_F32, 5)
OUTPUT(bf16, TS_WINOGRAD_CHANNELS, 3)
OUTPUT_GRADIENT(f32, TS_WINOGRAD_F32)
OUTPUT_GRADIENT(even, TS_WINOGRAD_EVEN)
OUTPUT_GRADIENT(odd, TS_WINOGRAD_ODD)
WEIGHTS_GRADIENT(f32, TS_WINOGRAD_F32)
WEIGHTS_GRADIENT(bf16, TS_WINOGRAD_CHANNELS)

const struct ts_winograd_kernels TS_TABLE(winograd) = {
    .input = {input_f32, input_channels, input_even, input_odd},
    .output = {{output_3_f32, output_3_bf16}, {output_5_f32, NULL}},
    .weights = {{weights_3_f32, NULL, weights_3_even, weights_3_odd}, {weights_5_f32}},
    .output_gradient = {output_gradient_f32, NULL, output_gradient_even, output_gradient_odd},
    .weights_gradient = {weights_gradient_f32, weights_gradient_bf16}};
