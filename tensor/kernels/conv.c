/* See conv.h. Each size is a function of its own, so that all accumulators live in registers: with 32 registers 14 x 2
 * of them leave room for two weights and one broadcast value. */
#include "tensor/kernels/conv.h"
#include "tensor/kernels/transpose.h"
#include "tensor/kernels/vec.h"

#if VL == 16
#define PIXELS 14
#define ROWS 14
#elif defined(__aarch64__) /* 32 registers, but a product takes its scalar from one too: 9 spill (.ci/aarch64.sh) */
#define PIXELS 8
#define ROWS 8
#elif VL == 8
#define PIXELS 6
#define ROWS 6
#else
#define PIXELS 5
#define ROWS 5
#endif
#define INLINE static inline __attribute__((always_inline))
#define UNROLL _Pragma("GCC unroll 16")
typedef int32_t pair __attribute__((may_alias)); /* two bf16 values, kept where a float would be */

/* A panel's channels that exist, to and from memory. Vectors with a tail need a mask, or a detour where there are no
 * masks. */
#if VL == 16
typedef __mmask16 lanes;
INLINE lanes lanes_of(int n) { return (lanes)(n >= VL ? 0xffff : n > 0 ? (1 << n) - 1 : 0); }
INLINE vf load_lanes(const float *p, lanes m) { return (vf)_mm512_maskz_loadu_ps(m, p); }
INLINE void store_lanes(float *p, vf v, lanes m) { _mm512_mask_storeu_ps(p, m, (__m512)v); }
#elif VL == 8
typedef vi lanes;
INLINE lanes lanes_of(int n) { return (vi){0, 1, 2, 3, 4, 5, 6, 7} < v_seti(n); }
INLINE vf load_lanes(const float *p, lanes m) { return (vf)_mm256_maskload_ps(p, (__m256i)m); }
INLINE void store_lanes(float *p, vf v, lanes m) { _mm256_maskstore_ps(p, (__m256i)m, (__m256)v); }
#else
typedef int lanes;
INLINE lanes lanes_of(int n) { return n; }
static __attribute__((noinline)) vf load_few(const float *p, int n)
{
    vf v = {0};
    for (int i = 0; i < n && i < VL; i++) v[i] = p[i];
    return v;
}
static __attribute__((noinline)) void store_few(float *p, vf v, int n)
{
    for (int i = 0; i < n && i < VL; i++) p[i] = v[i];
}
INLINE vf load_lanes(const float *p, lanes n) { return n >= VL ? v_load(p) : load_few(p, n); }
INLINE void store_lanes(float *p, vf v, lanes n)
{
    if (n >= VL) v_store(p, v);
    else store_few(p, v, n);
}
#endif

/* Sums over more k than this are made of parts: the rounding of a float sum grows with its length, and a published
 * convolution has 25,600 terms. Shorter parts leave as much, longer ones more: the published network's
 * error is half again as large with 192, for 1% less time at most. */
enum { PART = 64 };

/* acc + the products of both halves of x and b. A bf16 value is the upper half of the float that it stands for. */
INLINE vf dot2(vf acc, vf x, vf b)
{
#if defined(__AVX512BF16__)
    return (vf)_mm512_dpbf16_ps((__m512)acc, (__m512bh)x, (__m512bh)b);
#else
    const vi high = v_seti(-65536);
    return v_fma((vf)((vi)x << 16), (vf)((vi)b << 16), v_fma((vf)((vi)x & high), (vf)((vi)b & high), acc));
#endif
}

/* One k, or pair of them: pixels x vectors multiplications. */
#define STEP(u)                                                                                \
    {                                                                                          \
        vf b[2];                                                                               \
        UNROLL for (int v = 0; v < vectors; v++) b[v] = v_load(w + ((u)*vectors + v) * VL);    \
        UNROLL for (int p = 0; p < pixels; p++)                                                \
        {                                                                                      \
            const char *at = a[p / TS_TILE_GROUP] + stride[p % TS_TILE_GROUP];                 \
            if (bf16) {                                                                        \
                const vf x = (vf)v_seti(((const pair *)(const void *)at)[u]);                  \
                UNROLL for (int v = 0; v < vectors; v++) acc[p][v] = dot2(acc[p][v], x, b[v]); \
            } else {                                                                           \
                const vf x = v_set(((const float *)(const void *)at)[u]);                      \
                UNROLL for (int v = 0; v < vectors; v++) acc[p][v] += x * b[v];                \
            }                                                                                  \
        }                                                                                      \
    }
/* Base pointers and strides stay as they are, in registers: left alone, the compiler makes an address for each pixel
 * and k, which do not fit. */
#define KEEP_ADDRESSES                                \
    __asm__("" : "+r"(a[0]), "+r"(a[1]), "+r"(a[2])); \
    __asm__("" : "+r"(stride[1]), "+r"(stride[2]), "+r"(stride[3]), "+r"(stride[4]));

INLINE void tile(const ts_tile *t, const int pixels, const int vectors, const bool bf16)
{
    vf acc[PIXELS][2], whole[PIXELS][2];
    const ptrdiff_t ys = t->y_stride;
    lanes mask[2];
    bool parts = t->add; /* whole holds the sum of the parts before acc's */
    __asm__(""
            : "=m"(whole)); /* says that it is set: the compiler cannot see that parts guards it, and clearing it takes
                               as long as 1 k */
    UNROLL for (int v = 0; v < vectors; v++) mask[v] = lanes_of(t->channels - v * VL);
    if (t->add) {
        UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++)
        {
            whole[p][v] = load_lanes(t->y[p / TS_TILE_GROUP] + p % TS_TILE_GROUP * ys + v * VL, mask[v]);
            acc[p][v] = (vf){0};
        }
    } else {
        UNROLL for (int v = 0; v < vectors; v++)
        {
            vf b = t->bias ? load_lanes(t->bias + v * VL, mask[v]) : (vf){0};
            UNROLL for (int p = 0; p < pixels; p++) acc[p][v] = b;
        }
    }
    ptrdiff_t stride[TS_TILE_GROUP]; /* in bytes */
    const char *fetch0 = (const char *)t->fetch[0], *fetch1 = (const char *)t->fetch[1];
    UNROLL for (int i = 0; i < TS_TILE_GROUP; i++) stride[i] = i * t->a_stride * (ptrdiff_t)sizeof(float);
    ptrdiff_t left = 0, space = PART; /* of this segment, of this part */
    const char *a[3];
    const float *w = t->w;
    for (int g = 0; g < t->segments || left > 0;) {
        if (left == 0) {
            w = t->w + t->segment[g].w * (vectors * VL);
            UNROLL for (int i = 0; i < 3; i++) a[i] = (const char *)(t->a[i] + t->segment[g].a);
            left = t->segment[g++].count;
        }
        if (space == 0) {
            if (!parts)
                UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++)
                    whole[p][v] = acc[p][v];
            else
                UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++)
                    whole[p][v] += acc[p][v];
            UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++) acc[p][v] = (vf){0};
            parts = true;
            space = PART;
        }
        ptrdiff_t n = left < space ? left : space;
        left -= n;
        space -= n;
        for (; n >= 4; n -= 4) {
            STEP(0) __builtin_prefetch(fetch0);
            STEP(1) __builtin_prefetch(fetch1);
            STEP(2) __builtin_prefetch(fetch0 + 64);
            STEP(3) __builtin_prefetch(fetch1 + 64);
            fetch0 += t->fetch_step[0];
            fetch1 += t->fetch_step[1];
            w += 4 * vectors * VL;
            UNROLL for (int i = 0; i < 3; i++) a[i] += 4 * sizeof(float);
            KEEP_ADDRESSES
        }
        for (; n > 0; n--) {
            STEP(0)
            w += vectors * VL;
            UNROLL for (int i = 0; i < 3; i++) a[i] += sizeof(float);
            KEEP_ADDRESSES
        }
    }
    if (parts)
        UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++) acc[p][v] += whole[p][v];
    if (t->leak != 1) {
        const vf leak = v_set(t->leak);
        UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++)
            acc[p][v] = v_max(leak * acc[p][v], acc[p][v]);
    }
    UNROLL for (int p = 0; p < pixels; p++) UNROLL for (int v = 0; v < vectors; v++)
        store_lanes(t->y[p / TS_TILE_GROUP] + p % TS_TILE_GROUP * ys + v * VL, acc[p][v], mask[v]);
}

/* One pixel, or pair of them: rows x vectors multiplications. */
#define PIXEL                                                                                    \
    {                                                                                            \
        vf y[2];                                                                                 \
        UNROLL for (int v = 0; v < vectors; v++) y[v] = v_load(b + v * VL);                      \
        UNROLL for (int m = 0; m < rows; m++)                                                    \
        {                                                                                        \
            const vf x = bf16 ? (vf)v_seti(((const pair *)(const void *)a)[m]) : v_set(a[m]);    \
            UNROLL for (int v = 0; v < vectors; v++) acc[m][v] = bf16 ? dot2(acc[m][v], x, y[v]) \
                                                                      : acc[m][v] + x * y[v];    \
        }                                                                                        \
        if (!near) __builtin_prefetch(b + ahead), __builtin_prefetch(b + ahead + VL);            \
        a += as;                                                                                 \
        b += bs;                                                                                 \
    }

INLINE void sum(const ts_sum *t, const int rows, const int vectors, const bool near, const bool bf16)
{
    vf acc[ROWS][2];
    if (t->begin) UNROLL for (int m = 0; m < rows; m++) UNROLL for (int v = 0; v < vectors; v++) acc[m][v] = (vf){0};
    else
        UNROLL for (int m = 0; m < rows; m++) UNROLL for (int v = 0; v < vectors; v++)
            acc[m][v] = v_load(t->c + m * t->c_stride + v * VL);
    const ptrdiff_t as = t->a_stride, bs = t->b_stride, ahead = 8 * bs, step = t->fetch_step;
    const char *fetch = t->fetch;
    for (int r = 0; r < t->rows; r++) {
        const float *a = t->a + t->a_row[r], *b = t->b + t->b_row[r];
        int p = t->count;
        for (; p >= 2; p -= 2, fetch += step) {
            PIXEL
            if (!near) __builtin_prefetch(fetch, 0, 2), __builtin_prefetch(fetch + 64, 0, 2);
            PIXEL
        }
        if (p) PIXEL
    }
    UNROLL for (int m = 0; m < rows; m++) UNROLL for (int v = 0; v < vectors; v++)
        v_store(t->c + m * t->c_stride + v * VL, acc[m][v]);
}

static void columns(const float *x, int64_t pixels, int channels, float *restrict sum)
{
    const float *a = x, *b = x + channels, *c = b + channels, *d = c + channels;
    for (; pixels >= 4; pixels -= 4, a += 4 * channels, b += 4 * channels, c += 4 * channels, d += 4 * channels)
        for (int o = 0; o < channels; o++) sum[o] += (a[o] + b[o]) + (c[o] + d[o]);
    for (; pixels > 0; pixels--, a += channels)
        for (int o = 0; o < channels; o++) sum[o] += a[o];
}

static void panel(const float *x, ptrdiff_t stride, int64_t pixels, int channels, float *to)
{
    const lanes first = lanes_of(channels), second = lanes_of(channels - VL);
    if (channels <= VL)
        for (; pixels > 0; pixels--, x += stride, to += VL) v_store(to, load_lanes(x, first));
    else
        for (; pixels > 0; pixels--, x += stride, to += 2 * VL) {
            v_store(to, v_load(x));
            v_store(to + VL, load_lanes(x + VL, second));
        }
}

static void transpose(const float *x, ptrdiff_t stride, int pixels, int channels, float *to, ptrdiff_t plane)
{
    const int whole = pixels / VL * VL;
    for (int p = 0; p < whole; p += VL)
        for (int c = 0; c < channels; c += VL) {
            vf r[VL];
            UNROLL for (int i = 0; i < VL; i++) r[i] = v_load_part(x + (p + i) * stride + c, channels - c);
            v_turn(r);
            UNROLL for (int i = 0; i < VL; i++) if (i < channels - c) v_store(to + (c + i) * plane + p, r[i]);
        }
    for (int p = whole; p < pixels; p++)
        for (int c = 0; c < channels; c++) to[c * plane + p] = x[p * stride + c];
}

static void collect(const float *x, ptrdiff_t plane, int pixels, int channels, bool add, float leak, float *y,
                    ptrdiff_t stride)
{
    const int whole = pixels / VL * VL;
    for (int p = 0; p < whole; p += VL)
        for (int c = 0; c < channels; c += VL) {
            vf r[VL];
            UNROLL for (int i = 0; i < VL; i++) r[i] = i < channels - c ? v_load(x + (c + i) * plane + p) : (vf){0};
            v_turn(r);
            for (int i = 0; i < VL; i++) {
                float *to = y + (p + i) * stride + c;
                const vf v = add ? r[i] + v_load_part(to, channels - c) : r[i];
                v_store_part(to, v_max(v_set(leak) * v, v), channels - c);
            }
        }
    for (int p = whole; p < pixels; p++)
        for (int c = 0; c < channels; c++) {
            float *to = y + p * stride + c;
            const float v = x[c * plane + p] + (add ? *to : 0);
            *to = v > 0 ? v : leak * v;
        }
}

INLINE void gather_vectors(const float *x, ptrdiff_t step, const int taps, ptrdiff_t next, int pixels,
                           const int vectors, float *to)
{
    for (int p = 0; p < pixels; p++, x += step, to += vectors * VL) {
        vf sum[2];
        UNROLL for (int v = 0; v < vectors; v++) sum[v] = v_load(to + v * VL);
        UNROLL for (int t = 0; t < taps; t++) UNROLL for (int v = 0; v < vectors; v++)
            sum[v] += v_load(x + t * next + v * VL);
        UNROLL for (int v = 0; v < vectors; v++) v_store(to + v * VL, sum[v]);
    }
}

static void gather(const float *x, ptrdiff_t step, int taps, ptrdiff_t next, int pixels, int vectors, float *to)
{
    if (taps == 3 && vectors == 1) gather_vectors(x, step, 3, next, pixels, 1, to);
    else if (taps == 5 && vectors == 1) gather_vectors(x, step, 5, next, pixels, 1, to);
    else gather_vectors(x, step, taps, next, pixels, vectors, to);
}

static void finish(float *x, int64_t pixels, int channels, bool add, float leak, float *y)
{
    const int vectors = (channels + VL - 1) / VL;
    /* Each vector's end is written over by the next pixel's; what was just stored is not read, which would have to be
     * waited for. */
    for (int64_t p = 0; p < pixels; p++)
        for (int v = 0; v < vectors; v++) v_store(x + p * channels + v * VL, v_load(x + (p * vectors + v) * VL));
    const int64_t count = pixels * channels;
    for (int64_t i = 0; i < count; i += VL) {
        vf v = v_load_part(x + i, count - i);
        if (add) v += v_load_part(y + i, count - i);
        v_store_part(y + i, v_max(v_set(leak) * v, v), count - i);
    }
}

#define FOR_5(DO) DO(1) DO(2) DO(3) DO(4) DO(5)
#if PIXELS == 14
#define FOR_ALL(DO) FOR_5(DO) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12) DO(13) DO(14)
#elif PIXELS == 8
#define FOR_ALL(DO) FOR_5(DO) DO(6) DO(7) DO(8)
#elif PIXELS == 6
#define FOR_ALL(DO) FOR_5(DO) DO(6)
#else
#define FOR_ALL(DO) FOR_5(DO)
#endif
#define FUNCTIONS(n)                                                            \
    static void tile_##n##_1(const ts_tile *t) { tile(t, n, 1, false); }        \
    static void tile_##n##_2(const ts_tile *t) { tile(t, n, 2, false); }        \
    static void bf16_##n##_1(const ts_tile *t) { tile(t, n, 1, true); }         \
    static void bf16_##n##_2(const ts_tile *t) { tile(t, n, 2, true); }         \
    static void sum_##n##_1(const ts_sum *t) { sum(t, n, 1, false, false); }    \
    static void sum_##n##_2(const ts_sum *t) { sum(t, n, 2, false, false); }    \
    static void near_##n##_1(const ts_sum *t) { sum(t, n, 1, true, false); }    \
    static void near_##n##_2(const ts_sum *t) { sum(t, n, 2, true, false); }    \
    static void sum_bf16_##n##_1(const ts_sum *t) { sum(t, n, 1, true, true); } \
    static void sum_bf16_##n##_2(const ts_sum *t) { sum(t, n, 2, true, true); }
FOR_ALL(FUNCTIONS)

#define TILE_1(n) [n] = tile_##n##_1,
#define TILE_2(n) [n] = tile_##n##_2,
#define BF16_1(n) [n] = bf16_##n##_1,
#define BF16_2(n) [n] = bf16_##n##_2,
#define SUM_1(n) [n] = sum_##n##_1,
#define SUM_2(n) [n] = sum_##n##_2,
#define NEAR_1(n) [n] = near_##n##_1,
#define NEAR_2(n) [n] = near_##n##_2,
#define SUM_BF16_1(n) [n] = sum_bf16_##n##_1,
#define SUM_BF16_2(n) [n] = sum_bf16_##n##_2,
const struct ts_conv_kernels TS_TABLE(conv) = {
    .lanes = VL,
    .pixels = PIXELS,
    .rows = ROWS,
    .tile = {{FOR_ALL(TILE_1)}, {FOR_ALL(TILE_2)}},
    .tile_bf16 = {{FOR_ALL(BF16_1)}, {FOR_ALL(BF16_2)}},
    .sum = {{FOR_ALL(SUM_1)}, {FOR_ALL(SUM_2)}},
    .sum_near = {{FOR_ALL(NEAR_1)}, {FOR_ALL(NEAR_2)}},
    .sum_bf16 = {{FOR_ALL(SUM_BF16_1)}, {FOR_ALL(SUM_BF16_2)}},
    .columns = columns,
    .panel = panel,
    .transpose = transpose,
    .collect = collect,
    .gather = gather,
    .finish = finish,
};
