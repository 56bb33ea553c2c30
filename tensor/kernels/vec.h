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
typedef float vf_u
    __attribute__((vector_size(VL * 4), aligned(4), may_alias)); /* an unaligned view for loads and stores */

static inline vf v_load(const float *p) { return *(const vf_u *)p; }
static inline void v_store(float *p, vf x) { *(vf_u *)p = x; }
static inline vf v_set(float x) { return x - (vf){0}; }
static inline vi v_seti(int32_t x) { return x - (vi){0}; }
static inline vf v_select(vi mask, vf a, vf b) { return (vf)((mask & (vi)a) | (~mask & (vi)b)); }
/* a > b ? a : b and a < b ? a : b, so b where either is NaN. The instructions mean exactly that, but gcc does not find
 * them. */
#if defined(__AVX512F__)
static inline vf v_max(vf a, vf b) { return (vf)_mm512_max_ps((__m512)a, (__m512)b); }
static inline vf v_min(vf a, vf b) { return (vf)_mm512_min_ps((__m512)a, (__m512)b); }
#elif defined(__AVX2__)
static inline vf v_max(vf a, vf b) { return (vf)_mm256_max_ps((__m256)a, (__m256)b); }
static inline vf v_min(vf a, vf b) { return (vf)_mm256_min_ps((__m256)a, (__m256)b); }
#else
static inline vf v_max(vf a, vf b) { return v_select(a > b, a, b); }
static inline vf v_min(vf a, vf b) { return v_select(a < b, a, b); }
#endif
static inline vf v_abs(vf a) { return (vf)((vi)a & v_seti(0x7fffffff)); }

/* a b + c. Where c is a product too, the compiler would fuse either of them, in one function this and in the next the
 * other. */
static inline vf v_fma(vf a, vf b, vf c)
{
#if defined(__AVX512F__)
    return (vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#elif defined(__AVX2__)
    return (vf)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
    return a * b + c;
#endif
}

typedef uint32_t vu __attribute__((vector_size(VL * 4)));

/* The upper half of each lane becomes the nearest bf16: 0x7fff carries into it from above the middle, and 1 more in the
 * middle where it is odd. */
static inline vu v_bf16(vf x)
{
    const vu bits = (vu)x;
    return (vu)v_select(x == x, (vf)(bits + 0x7fff + (bits >> 16 & 1)), (vf)(bits | 0x00400000));
}

/* The same as halves, denormals being whatever the instruction set makes of them. */
typedef uint16_t vu16 __attribute__((vector_size(VL * 2)));
static inline vu16 v_bf16_half(vf x)
{
#if defined(__AVX512BF16__)
    return (vu16)_mm512_cvtneps_pbh((__m512)x);
#else
    return __builtin_convertvector(v_bf16(x) >> 16, vu16);
#endif
}

/* The bf16 values of each lane of two vectors, those of even in the low halves; denormals as above. */
static inline vf v_pairs(vf even, vf odd)
{
#if defined(__AVX512BF16__)
    static const uint16_t order[2 * VL] = {0, 16, 1, 17, 2,  18, 3,  19, 4,  20, 5,  21, 6,  22, 7,  23,
                                           8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31};
    const __m512i both = (__m512i)_mm512_cvtne2ps_pbh((__m512)odd, (__m512)even);
    return (vf)_mm512_permutexvar_epi16(_mm512_loadu_si512(order), both);
#else
    const vu low = __builtin_convertvector(v_bf16_half(even), vu), high = __builtin_convertvector(v_bf16_half(odd), vu);
    return (vf)(low | high << 16);
#endif
}

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

/* The first n values, 0 <= n < VL; the other lanes are 0 and their memory is not touched. */
static inline vf v_load_n(const float *p, int n)
{
#if defined(__AVX512F__)
    return (vf)_mm512_maskz_loadu_ps((__mmask16)((1u << n) - 1), p);
#elif defined(__AVX2__)
    const vi lane = {0, 1, 2, 3, 4, 5, 6, 7};
    return (vf)_mm256_maskload_ps(p, (__m256i)(lane < v_seti(n)));
#else
    vf x = {0};
    for (int i = 0; i < n; i++) x[i] = p[i];
    return x;
#endif
}
static inline void v_store_n(float *p, vf x, int n)
{
#if defined(__AVX512F__)
    _mm512_mask_storeu_ps(p, (__mmask16)((1u << n) - 1), (__m512)x);
#elif defined(__AVX2__)
    const vi lane = {0, 1, 2, 3, 4, 5, 6, 7};
    _mm256_maskstore_ps(p, (__m256i)(lane < v_seti(n)), (__m256)x);
#else
    for (int i = 0; i < n; i++) p[i] = x[i];
#endif
}

/* left > 0 values or VL of them, whichever is less: for the last step of a loop. */
static inline vf v_load_part(const float *p, int64_t left) { return left >= VL ? v_load(p) : v_load_n(p, (int)left); }
static inline void v_store_part(float *p, vf x, int64_t left)
{
    if (left >= VL) v_store(p, x);
    else v_store_n(p, x, (int)left);
}
#endif
