#include "tensor/kernels/vmath_arrays.h"
#include "tensor/kernels/vmath.h"

#define ARRAY(name)                                                                                          \
    static void name##_array(int64_t n, const float *x, float *y)                                            \
    {                                                                                                        \
        for (int64_t i = 0; i < n; i += VL) v_store_part(y + i, v_##name(v_load_part(x + i, n - i)), n - i); \
    }
ARRAY(exp)
ARRAY(exp2)
ARRAY(expm1)
ARRAY(log)
ARRAY(tanh)
ARRAY(sigmoid)
ARRAY(gamma)

const struct ts_vmath_arrays_kernels TS_TABLE(vmath_arrays) = {
    .exp = exp_array,
    .exp2 = exp2_array,
    .expm1 = expm1_array,
    .log = log_array,
    .tanh = tanh_array,
    .sigmoid = sigmoid_array,
    .gamma = gamma_array,
};
