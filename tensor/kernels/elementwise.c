#include "tensor/kernels/elementwise.h"
#include "tensor/kernels/vmath.h"
#include <stddef.h>
#include <string.h>

static inline void put(float *p, vf x, int64_t left, bool accumulate)
{
    v_store_part(p, accumulate ? v_load_part(p, left) + x : x, left);
}

static inline vf leaky_of(vf x, vf leak) { return v_select(x > v_set(0.0f), x, x * leak); }
static inline vf slope(vf y, vf dy, vf leak) { return v_select(y > v_set(0.0f), dy, dy * leak); }

static void leaky(int64_t n, const float *x, float leak, float *y)
{
    const vf l = v_set(leak);
    int64_t i = 0;
    for (; i + VL <= n; i += VL) v_store(y + i, leaky_of(v_load(x + i), l));
    if (i < n) v_store_part(y + i, leaky_of(v_load_part(x + i, n - i), l), n - i);
}

static void leaky_backward(int64_t n, const float *y, const float *dy, float leak, float *dx, bool accumulate)
{
    const vf l = v_set(leak);
    for (int64_t i = 0; i < n; i += VL)
        put(dx + i, slope(v_load_part(y + i, n - i), v_load_part(dy + i, n - i), l), n - i, accumulate);
}

static void tanh_forward(int64_t n, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i += VL) v_store_part(y + i, v_tanh(v_load_part(x + i, n - i)), n - i);
}

static void tanh_backward(int64_t n, const float *y, const float *dy, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < n; i += VL) {
        vf t = v_load_part(y + i, n - i);
        put(dx + i, v_load_part(dy + i, n - i) * (1.0f - t * t), n - i, accumulate);
    }
}

static void selu(int64_t n, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i += VL) {
        vf v = v_load_part(x + i, n - i);
        vf below = (float)(TS_SELU_SCALE * TS_SELU_ALPHA) * v_expm1(v);
        v_store_part(y + i, v_select(v > v_set(0.0f), v * (float)TS_SELU_SCALE, below), n - i);
    }
}

static void selu_backward(int64_t n, const float *y, const float *dy, float *dx, bool accumulate)
{
    for (int64_t i = 0; i < n; i += VL) {
        vf v = v_load_part(y + i, n - i);
        vf d = v_select(v > v_set(0.0f), v_set((float)TS_SELU_SCALE), v + (float)(TS_SELU_SCALE * TS_SELU_ALPHA));
        put(dx + i, v_load_part(dy + i, n - i) * d, n - i, accumulate);
    }
}

/* The logarithm's argument is rounded near 1, where the series (next term 3/40 x^5) takes over. Beyond 1e18 the square
 * would overflow. */
static inline vf asinh_of(vf x)
{
    const vf a = v_abs(x), small = a * (1.0f - a * a * (1.0f / 6));
    const vf root = v_select(a > v_set(1e18f), a, v_sqrt(a * a + 1.0f));
    const vf far = v_log(a * 0.5f + root * 0.5f) + 0.69314718056f;
    const vf y = v_select(a < v_set(0.02f), small, far);
    return (vf)((vi)y | ((vi)x & v_seti(INT32_MIN)));
}

static void asinh_scaled(int64_t n, float s, const float *x, float *y)
{
    for (int64_t i = 0; i < n; i += VL) v_store_part(y + i, asinh_of(v_load_part(x + i, n - i) * s), n - i);
}

static void add(int64_t n, const float *a, const float *b, float *y)
{
    int64_t i = 0;
    for (; i + VL <= n; i += VL) v_store(y + i, v_load(a + i) + v_load(b + i));
    if (i < n) v_store_part(y + i, v_load_part(a + i, n - i) + v_load_part(b + i, n - i), n - i);
}

static void scale(int64_t n, float s, const float *x, float *y, bool accumulate)
{
    for (int64_t i = 0; i < n; i += VL) put(y + i, v_load_part(x + i, n - i) * s, n - i, accumulate);
}

static void add_leaky(int64_t pixels, int c, const float *x, const float *g, float leak, float *y)
{
    const vf l = v_set(leak);
    for (int64_t p = 0; p < pixels; p++, x += c, y += c)
        for (int i = 0; i < c; i += VL)
            v_store_part(y + i, leaky_of(v_load_part(x + i, c - i) + v_load_part(g + i, c - i), l), c - i);
}

/* Pixels in one float partial sum: its error stays below 64 half ulps of the largest partial sum before it goes into a
 * double. */
enum { RUN = 64 };

static void add_leaky_backward(int64_t pixels, int c, const float *y, const float *dy, float leak, float *dx,
                               bool accumulate, double *sum)
{
    const vf l = v_set(leak);
    for (int64_t p0 = 0; p0 < pixels; p0 += RUN) {
        int64_t p1 = p0 + RUN < pixels ? p0 + RUN : pixels;
        for (int i = 0; i < c; i += VL) {
            vf total = {0};
            for (int64_t p = p0; p < p1; p++) {
                vf d = slope(v_load_part(y + p * c + i, c - i), v_load_part(dy + p * c + i, c - i), l);
                total += d;
                if (dx) put(dx + p * c + i, d, c - i, accumulate);
            }
            if (sum)
                for (int j = 0; j < VL && i + j < c; j++) sum[i + j] += total[j];
        }
    }
}

static void broadcast(int64_t pixels, int c, const float *g, float *y, bool accumulate)
{
    for (int64_t p = 0; p < pixels; p++, y += c)
        for (int i = 0; i < c; i += VL) put(y + i, v_load_part(g + i, c - i), c - i, accumulate);
}

static inline __attribute__((always_inline)) void copy_pixels(int64_t pixels, int c, const float *src,
                                                              int64_t src_stride, float *dst, int64_t dst_stride,
                                                              const bool accumulate)
{
    if (c < VL) /* one mask for all pixels */
        for (int64_t p = 0; p < pixels; p++, src += src_stride, dst += dst_stride)
            v_store_n(dst, accumulate ? v_load_n(dst, c) + v_load_n(src, c) : v_load_n(src, c), c);
    else
        for (int64_t p = 0; p < pixels; p++, src += src_stride, dst += dst_stride)
            for (int i = 0; i < c; i += VL) put(dst + i, v_load_part(src + i, c - i), c - i, accumulate);
}

static void copy(int64_t pixels, int c, const float *src, int64_t src_stride, float *dst, int64_t dst_stride,
                 bool accumulate)
{
    if (accumulate) copy_pixels(pixels, c, src, src_stride, dst, dst_stride, true);
    else copy_pixels(pixels, c, src, src_stride, dst, dst_stride, false);
}

static void gru(int64_t pixels, int c, const float *ih, const float *hh, int64_t hh_stride, const float *old, float *y,
                float *saved)
{
    for (int64_t p = 0; p < pixels; p++, ih += 3 * (int64_t)c, hh += hh_stride, y += c) {
        for (int i = 0; i < c; i += VL) {
            int left = c - i;
            vf z = v_sigmoid(v_load_part(ih + i, left) + v_load_part(hh + i, left));
            vf r = v_sigmoid(v_load_part(ih + c + i, left) + v_load_part(hh + c + i, left));
            vf n = v_tanh(v_load_part(ih + 2 * c + i, left) + r * v_load_part(hh + 2 * c + i, left));
            vf v = z * n;
            if (old) {
                vf o = v_load_part(old + p * c + i, left);
                v = (o - z * o) + v;
            }
            v_store_part(y + i, v, left);
            if (saved) {
                float *s = saved + p * 4 * c + i;
                v_store_part(s, z, left);
                v_store_part(s + c, r, left);
                v_store_part(s + 2 * c, n, left);
                v_store_part(s + 3 * c, v_load_part(hh + 2 * c + i, left), left);
            }
        }
    }
}

static void gru_backward(int64_t pixels, int c, const float *saved, const float *old, const float *dy, float *d,
                         float *dold, bool accumulate, double *sum)
{
    for (int64_t p0 = 0; p0 < pixels; p0 += RUN) {
        int64_t p1 = p0 + RUN < pixels ? p0 + RUN : pixels;
        for (int i = 0; i < c; i += VL) {
            const int left = c - i;
            vf total[4] = {{0}, {0}, {0}, {0}};
            for (int64_t p = p0; p < p1; p++) {
                const float *s = saved + p * 4 * c + i;
                float *to = d + p * 4 * c + i;
                const vf z = v_load_part(s, left), r = v_load_part(s + c, left), n = v_load_part(s + 2 * c, left),
                         dv = v_load_part(dy + p * c + i, left);
                const vf o = old ? v_load_part(old + p * c + i, left) : (vf){0};
                const vf m = dv * z * (1.0f - n * n), az = dv * (n - o) * z * (1.0f - z);
                const vf ar = m * v_load_part(s + 3 * c, left) * r * (1.0f - r), hn = m * r;
                v_store_part(to, m, left);
                v_store_part(to + c, az, left);
                v_store_part(to + 2 * c, ar, left);
                v_store_part(to + 3 * c, hn, left);
                if (dold) put(dold + p * c + i, dv * (1.0f - z), left, accumulate);
                total[0] += m;
                total[1] += az;
                total[2] += ar;
                total[3] += hn;
            }
            for (int k = 0; sum && k < 4; k++)
                for (int j = 0; j < VL && j < left; j++) sum[k * c + i + j] += total[k][j];
        }
    }
}

static inline uint32_t bits_of(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

#if VL == 16
static void from_half(int64_t n, const void *x, float *y)
{
    const char *from = x;
    int64_t i = 0;
    for (; n - i >= VL; i += VL)
        v_store(y + i, (vf)_mm512_cvtph_ps(_mm256_loadu_si256((const __m256i *)(const void *)(from + 2 * i))));
    if (i == n) return;
    const __mmask16 rest = (__mmask16)((1 << (n - i)) - 1);
    _mm512_mask_storeu_ps(y + i, rest, _mm512_cvtph_ps(_mm256_maskz_loadu_epi16(rest, from + 2 * i)));
}
#else
/* Without branches, so that the loop becomes one of vectors. */
static void from_half(int64_t n, const void *x, float *restrict y)
{
    for (int64_t i = 0; i < n; i++) {
        uint16_t bits16;
        memcpy(&bits16, (const char *)x + 2 * i, sizeof bits16);
        const uint32_t h = bits16, sign = (h & 0x8000) << 16, exponent = h >> 10 & 31, fraction = h & 0x3ff;
        const uint32_t usual = (exponent == 31 ? 255u : exponent + 112) << 23 | fraction << 13,
                       subnormal = bits_of((float)(int32_t)fraction * 0x1p-24f);
        const uint32_t bits = sign | (exponent ? usual : subnormal);
        memcpy(&y[i], &bits, sizeof bits);
    }
}
#endif

enum { PART = 16 * VL, SUMS = 4 }; /* of a row, as floats in the first cache; and what a row is added up in */

/* sum += the products of count numbers, PART at most. */
static inline void add_products(int64_t count, const float *w, const float *x, vf sum[SUMS])
{
    int64_t i = 0;
    for (; i + SUMS * VL <= count; i += SUMS * VL)
        for (int s = 0; s < SUMS; s++) sum[s] = v_fma(v_load(w + i + s * VL), v_load(x + i + s * VL), sum[s]);
    for (; i < count; i += VL) sum[0] = v_fma(v_load_part(w + i, count - i), v_load_part(x + i, count - i), sum[0]);
}

static inline int64_t part_of(int64_t left) { return left < PART ? left : PART; }

static inline float total(const vf sum[SUMS]) { return v_sum(sum[0] + sum[1] + (sum[2] + sum[3])); }

static void add_dots(int64_t rows, int64_t n, const float *w, const float *x, float *y)
{
    for (int64_t r = 0; r < rows; r++, w += n) {
        vf sum[SUMS] = {0};
        for (int64_t i = 0; i < n; i += PART) add_products(part_of(n - i), w + i, x + i, sum);
        y[r] += total(sum);
    }
}

static void add_dots_half(int64_t rows, int64_t n, const void *w, const float *x, float *y)
{
    const char *from = w;
    float part[PART];
    for (int64_t r = 0; r < rows; r++, from += 2 * n) {
        vf sum[SUMS] = {0};
        for (int64_t i = 0; i < n; i += PART) {
            from_half(part_of(n - i), from + 2 * i, part);
            add_products(part_of(n - i), part, x + i, sum);
        }
        y[r] += total(sum);
    }
}

const struct ts_elementwise_kernels TS_TABLE(elementwise) = {
    .leaky = leaky,
    .leaky_backward = leaky_backward,
    .tanh = tanh_forward,
    .tanh_backward = tanh_backward,
    .selu = selu,
    .selu_backward = selu_backward,
    .asinh = asinh_scaled,
    .from_half = from_half,
    .add_dots = add_dots,
    .add_dots_half = add_dots_half,
    .add = add,
    .scale = scale,
    .add_leaky = add_leaky,
    .add_leaky_backward = add_leaky_backward,
    .broadcast = broadcast,
    .copy = copy,
    .gru = gru,
    .gru_backward = gru_backward,
};
