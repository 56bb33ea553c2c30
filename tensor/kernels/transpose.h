/* Transposition of VL rows of VL values in registers. Only files in this folder include it. */
#ifndef TS_TRANSPOSE_H
#define TS_TRANSPOSE_H
#include "tensor/kernels/vec.h"

/* Lane l of the two vectors that a stage of a transposition makes of a and b: squares of side h trade places. */
#define TURN_LOW(l, h) ((l) & (h) ? VL + (l) - (h) : (l))
#define TURN_HIGH(l, h) ((l) & (h) ? VL + (l) : (l) + (h))
#define TURN_LANES_4(f, i, h) f(i, h), f(i + 1, h), f(i + 2, h), f(i + 3, h)
#if VL == 16
#define TURN_LANES(f, h) TURN_LANES_4(f, 0, h), TURN_LANES_4(f, 4, h), TURN_LANES_4(f, 8, h), TURN_LANES_4(f, 12, h)
#elif VL == 8
#define TURN_LANES(f, h) TURN_LANES_4(f, 0, h), TURN_LANES_4(f, 4, h)
#else
#define TURN_LANES(f, h) TURN_LANES_4(f, 0, h)
#endif
#define TURN_STAGE(h)                                                         \
    _Pragma("GCC unroll 16") for (int i = 0; i < VL; i++) if (!(i & (h)))     \
    {                                                                         \
        const vf a = r[i], b = r[i + (h)];                                    \
        r[i] = __builtin_shufflevector(a, b, TURN_LANES(TURN_LOW, h));        \
        r[i + (h)] = __builtin_shufflevector(a, b, TURN_LANES(TURN_HIGH, h)); \
    }

/* VL rows of VL values: columns become rows. */
static inline __attribute__((always_inline)) void v_turn(vf r[VL])
{
#if VL == 16
    TURN_STAGE(8)
#endif
#if VL >= 8
    TURN_STAGE(4)
#endif
    TURN_STAGE(2)
    TURN_STAGE(1)
}
#endif
