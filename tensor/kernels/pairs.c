/* See pairs.h. */
#include "tensor/kernels/pairs.h"
#include "tensor/kernels/vec.h"
#include <stdbool.h>

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

const struct ts_pairs_kernels TS_TABLE(pairs) = {.of_two = of_two};
