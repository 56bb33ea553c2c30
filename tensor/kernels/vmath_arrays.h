/* The functions of vmath.h on arrays: y[i] = f(x[i]). x and y may be the same. For errors and special values see there.
 */
#ifndef TS_VMATH_ARRAYS_H
#define TS_VMATH_ARRAYS_H
#include "tensor/kernels/family.h"
#include <stdint.h>

struct ts_vmath_arrays_kernels {
    void (*exp)(int64_t n, const float *x, float *y);
    void (*exp2)(int64_t n, const float *x, float *y);
    void (*expm1)(int64_t n, const float *x, float *y);
    void (*log)(int64_t n, const float *x, float *y);
    void (*tanh)(int64_t n, const float *x, float *y);
    void (*sigmoid)(int64_t n, const float *x, float *y);
    void (*gamma)(int64_t n, const float *x, float *y);
};
TS_FAMILY(vmath_arrays)
#endif
