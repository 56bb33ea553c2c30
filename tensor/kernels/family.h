/* How a kernel is compiled once per instruction set and chosen at start.
 *
 * A family is one file tensor/kernels/NAME.c that the Makefile compiles once for each ISA with TS_ISA_SUFFIX set to
 * base, avx2, avx512, avx512bf16 or amx. It ends with
 *     const struct ts_NAME_kernels TS_TABLE(NAME) = { .entry = function, ... };
 * with static functions above. The family's header (tensor/kernels/NAME.h) declares the struct and says
 *     TS_FAMILY(NAME)
 * which gives ts_NAME_k(): the table of the ISA in use. Kernels are serial; the loops of tensor/team.h wrap them. */
#ifndef TS_FAMILY_H
#define TS_FAMILY_H
#include "tensor/cpu.h"

#define TS_PASTE_(a, b, c, d) a##b##c##d
#define TS_PASTE(a, b, c, d) TS_PASTE_(a, b, c, d)
#define TS_TABLE(name) TS_PASTE(ts_, name, _, TS_ISA_SUFFIX)

#if defined(__x86_64__)
#define TS_FAMILY(name)                                                                             \
    extern const struct ts_##name##_kernels ts_##name##_base, ts_##name##_avx2, ts_##name##_avx512, \
        ts_##name##_avx512bf16, ts_##name##_amx;                                                    \
    static inline const struct ts_##name##_kernels *ts_##name##_k(void)                             \
    {                                                                                               \
        switch (ts_isa_now()) {                                                                     \
        case TS_AMX: return &ts_##name##_amx;                                                       \
        case TS_AVX512BF16: return &ts_##name##_avx512bf16;                                         \
        case TS_AVX512: return &ts_##name##_avx512;                                                 \
        case TS_AVX2: return &ts_##name##_avx2;                                                     \
        default: return &ts_##name##_base;                                                          \
        }                                                                                           \
    }
#else
#define TS_FAMILY(name)                                       \
    extern const struct ts_##name##_kernels ts_##name##_base; \
    static inline const struct ts_##name##_kernels *ts_##name##_k(void) { return &ts_##name##_base; }
#endif
#endif
