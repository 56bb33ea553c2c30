/* See pairs.h. */
#include "tensor/kernels/pairs.h"
#include "tensor/kernels/vec.h"
#include <stdbool.h>

#if VL == 16
#define EVERY_OTHER(first)                                                                                         \
    first, first + 2, first + 4, first + 6, first + 8, first + 10, first + 12, first + 14, first + 16, first + 18, \
        first + 20, first + 22, first + 24, first + 26, first + 28, first + 30
#elif VL == 8
#define EVERY_OTHER(first) first, first + 2, first + 4, first + 6, first + 8, first + 10, first + 12, first + 14
#else
#define EVERY_OTHER(first) first, first + 2, first + 4, first + 6
#endif

#if defined(__AVX512BF16__)
enum { DENORMAL = 0x20 }; /* which the conversion would take for zeros */
#endif

/* The values of a, and those of b behind them. */
static inline vf both(vf a, vf b)
{
#if defined(__AVX512BF16__)
    if (!(_mm512_fpclass_ps_mask((__m512)a, DENORMAL) | _mm512_fpclass_ps_mask((__m512)b, DENORMAL)))
        return (vf)_mm512_cvtne2ps_pbh((__m512)b, (__m512)a);
#endif
    const vu first = v_bf16(a), second = v_bf16(b), even = __builtin_shufflevector(first, second, EVERY_OTHER(0)),
             odd = __builtin_shufflevector(first, second, EVERY_OTHER(1));
    return (vf)(even >> 16 | (odd & 0xffff0000));
}

#if defined(__AVX512BF16__)
/* Pixels of one vector at most, before the first that has a denormal; returns how many. */
static int64_t of_one_vector(const float *x, int64_t pixels, int channels, float *to, ptrdiff_t stride)
{
    const __mmask16 from = (__mmask16)((1u << channels) - 1);
    const __mmask8 put = (__mmask8)((1u << (channels + 1) / 2) - 1);
    int64_t p = 0;
    for (; p < pixels; p++, x += channels, to += stride) {
        const __m512 v = _mm512_maskz_loadu_ps(from, x);
        if (_mm512_fpclass_ps_mask(v, DENORMAL)) break;
        _mm256_mask_storeu_epi32(to, put, (__m256i)_mm512_cvtneps_pbh(v));
    }
    return p;
}
#endif

static void of_channels(const float *x, int64_t pixels, int channels, float *to, ptrdiff_t stride)
{
    int64_t run = channels; /* of values without a gap */
    if (channels % 2 == 0 && stride == channels / 2) run *= pixels, pixels = 1;
#if defined(__AVX512BF16__)
    else if (channels <= VL) {
        const int64_t done = of_one_vector(x, pixels, channels, to, stride);
        pixels -= done, x += done * run, to += done * stride;
    }
#endif
    for (; pixels > 0; pixels--, x += run, to += stride)
        for (int64_t i = 0; i < run; i += 2 * VL) {
            const int64_t left = run - i;
            const vf a = v_load_part(x + i, left), b = left > VL ? v_load_part(x + i + VL, left - VL) : (vf){0};
            v_store_part(to + i / 2, both(a, b), (left + 1) / 2);
        }
}

static void of_two(const float *even, const float *odd, ptrdiff_t step, int64_t pixels, int64_t count, int64_t width,
                   float *to, ptrdiff_t to_step)
{
    const int64_t whole = odd ? (count < width ? count : width) / VL * VL : 0;
    for (int64_t p = 0; p < pixels; p++, even += step, odd += odd ? step : 0, to += to_step) {
        int64_t i = 0;
        for (; i < whole; i += VL) v_store(to + i, v_pairs(v_load(even + i), v_load(odd + i)));
        for (; i < width; i += VL) {
            const bool there = i < count;
            const vf a = there ? v_load_part(even + i, count - i) : (vf){0},
                     b = there && odd ? v_load_part(odd + i, count - i) : (vf){0};
            v_store_part(to + i, v_pairs(a, b), width - i);
        }
    }
}

const struct ts_pairs_kernels TS_TABLE(pairs) = {.of_channels = of_channels, .of_two = of_two};
