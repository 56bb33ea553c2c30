/* GCC/clang vector types, VL floats wide: 4 (base), 8 (avx2), 16 (avx512). Only files in this folder include it.
 * Comparisons give vi masks of 0 / -1. */
#ifndef TS_VEC_H
#define TS_VEC_H
#include <math.h>
#include <stdint.h>
#include <string.h>
#if defined(__AVX512F__) || defined(__AVX2__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__)
#define VL 16
#elif defined(__AVX2__)
#define VL 8
#else
#define VL 4
#endif

typedef float vf __attribute__((vector_size(VL * 4)));
typedef int32_t vi __attribute__((vector_size(VL * 4)));
typedef float vf_u __attribute__((vector_size(VL * 4), aligned(4), may_alias)); /* an unaligned view for loads and stores */

static inline vf v_load(const float *p) { return *(const vf_u *)p; }
static inline void v_store(float *p, vf x) { *(vf_u *)p = x; }
static inline vf v_set(float x) { return x - (vf){0}; }
static inline vi v_seti(int32_t x) { return x - (vi){0}; }
static inline vf v_select(vi mask, vf a, vf b) { return (vf)((mask & (vi)a) | (~mask & (vi)b)); }
static inline vf v_max(vf a, vf b) { return v_select(a > b, a, b); } /* b where either is NaN */
static inline vf v_min(vf a, vf b) { return v_select(a < b, a, b); } /* b where either is NaN */
static inline vf v_abs(vf a) { return (vf)((vi)a & v_seti(0x7fffffff)); }

static inline vf v_sqrt(vf x)
{
#if defined(__AVX512F__)
    return (vf)_mm512_sqrt_ps((__m512)x);
#elif defined(__AVX2__)
    return (vf)_mm256_sqrt_ps((__m256)x);
#else
    vf r;
    for (int i = 0; i < VL; i++) r[i] = sqrtf(x[i]);
    return r;
#endif
}

/* Sum of the lanes in index order pairs: ((0+1)+(2+3))+..., the same for every width only when the caller says so. */
static inline float v_sum(vf x)
{
    float a[VL];
    memcpy(a, &x, sizeof a);
    for (int s = 1; s < VL; s *= 2)
        for (int i = 0; i < VL; i += 2 * s) a[i] += a[i + s];
    return a[0];
}

/* n < VL values; the other lanes are 0. */
static inline vf v_load_n(const float *p, int n)
{
    vf x = {0};
    memcpy(&x, p, (size_t)n * sizeof(float));
    return x;
}
static inline void v_store_n(float *p, vf x, int n) { memcpy(p, &x, (size_t)n * sizeof(float)); }
#endif
