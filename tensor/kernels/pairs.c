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

/* The values of a, and those of b behind them. */
static inline vf both(vf a, vf b)
{
#if defined(__AVX512BF16__)
    enum { DENORMAL = 0x20 }; /* which the conversion would take for zeros */
    if (!(_mm512_fpclass_ps_mask((__m512)a, DENORMAL) | _mm512_fpclass_ps_mask((__m512)b, DENORMAL)))
        return (vf)_mm512_cvtne2ps_pbh((__m512)b, (__m512)a);
#endif
    const vu first = v_bf16(a), second = v_bf16(b), even = __builtin_shufflevector(first, second, EVERY_OTHER(0)),
             odd = __builtin_shufflevector(first, second, EVERY_OTHER(1));
    return (vf)(even >> 16 | (odd & 0xffff0000));
}

static void of_channels(const float *x, int64_t pixels, int channels, float *to, ptrdiff_t stride)
{
    int64_t run = channels; /* of values without a gap */
    if (channels % 2 == 0 && stride == channels / 2) run *= pixels, pixels = 1;
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
    for (int64_t p = 0; p < pixels; p++)
        for (int64_t i = 0; i < width; i += VL) {
            const bool there = i < count;
            const vf a = there ? v_load_part(even + p * step + i, count - i) : (vf){0},
                     b = there && odd ? v_load_part(odd + p * step + i, count - i) : (vf){0};
            const vu low = __builtin_convertvector(v_bf16_half(a), vu),
                     high = __builtin_convertvector(v_bf16_half(b), vu);
            v_store_part(to + p * to_step + i, (vf)(low | high << 16), width - i);
        }
}

const struct ts_pairs_kernels TS_TABLE(pairs) = {.of_channels = of_channels, .of_two = of_two};
