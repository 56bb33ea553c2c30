/* What shading needs beyond vec.h: vectors of VL doubles as two halves, and pixels with interleaved channels to and
 * from lanes. */
#ifndef TS_VEC_DOUBLE_H
#define TS_VEC_DOUBLE_H
#include "tensor/kernels/vec.h"
#include <stdbool.h>

/* Compilers give up on inlining functions of this size, and then vectors travel through memory. */
#define V_INLINE static inline __attribute__((always_inline))

typedef double vd __attribute__((vector_size(VL * 4))); /* VL / 2 lanes: a pair holds what a vf holds */
typedef int64_t vq __attribute__((vector_size(VL * 4)));
typedef float v_half __attribute__((vector_size(VL * 2)));
typedef float v8 __attribute__((vector_size(32)));

#if VL == 16
#define V_LOW 0, 1, 2, 3, 4, 5, 6, 7
#define V_HIGH 8, 9, 10, 11, 12, 13, 14, 15
#elif VL == 8
#define V_LOW 0, 1, 2, 3
#define V_HIGH 4, 5, 6, 7
#else
#define V_LOW 0, 1
#define V_HIGH 2, 3
#endif

static inline vd d_set(double x) { return x - (vd){0}; }
static inline vd d_select(vq mask, vd a, vd b) { return (vd)((mask & (vq)a) | (~mask & (vq)b)); }
#if defined(__AVX512F__)
static inline vd d_max(vd a, vd b) { return (vd)_mm512_max_pd((__m512d)a, (__m512d)b); }
#elif defined(__AVX2__)
static inline vd d_max(vd a, vd b) { return (vd)_mm256_max_pd((__m256d)a, (__m256d)b); }
#else
static inline vd d_max(vd a, vd b) { return d_select(a > b, a, b); }
#endif

static inline vd d_fma(vd a, vd b, vd c) /* as v_fma */
{
#if defined(__AVX512F__)
    return (vd)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
#elif defined(__AVX2__)
    return (vd)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
#else
    return a * b + c;
#endif
}

V_INLINE void d_split(vf x, vd half[2])
{
    half[0] = __builtin_convertvector(__builtin_shufflevector(x, x, V_LOW), vd);
    half[1] = __builtin_convertvector(__builtin_shufflevector(x, x, V_HIGH), vd);
}

V_INLINE vf d_join(const vd half[2])
{
    v_half a = __builtin_convertvector(half[0], v_half), b = __builtin_convertvector(half[1], v_half);
    return __builtin_shufflevector(a, b, V_LOW, V_HIGH);
}

/* 1 / sqrt(x), 1e-200 <= x <= 1e200, to 1e-12 */
static inline vd d_rsqrt(vd x)
{
#if defined(__AVX512F__)
    vd y = (vd)_mm512_rsqrt14_pd((__m512d)x),
       e = 1.0 - x * y * y; /* |e| < 2^-13; (1 - e)^(-1/2) = 1 + e/2 + 3 e^2/8 + 5 e^3/16 ... */
    return y + y * e * (0.375 * e + 0.5);
#elif defined(__AVX2__)
    return 1.0 / (vd)_mm256_sqrt_pd((__m256d)x);
#else
    vd y;
    for (int i = 0; i < VL / 2; i++) y[i] = 1.0 / sqrt(x[i]);
    return y;
#endif
}

/* first, first + 1, ... in one half */
static inline vd d_count(double first)
{
    static const double index[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    vd r;
    memcpy(&r, index, sizeof r);
    return r + first;
}

static inline vi v_lanes_below(int n)
{
    static const int32_t index[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    vi r;
    memcpy(&r, index, sizeof r);
    return r < v_seti(n);
}

static inline bool v_any(vi mask)
{
#if defined(__AVX512F__)
    return _mm512_test_epi32_mask((__m512i)mask, (__m512i)mask) != 0;
#elif defined(__AVX2__)
    return _mm256_movemask_ps((__m256)mask) != 0;
#else
    return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
#endif
}
#endif
