/* Vector exp, exp2, expm1, log, tanh, sigmoid, gamma. Largest error over all floats, in units in the last place of the
 * double result rounded to float: exp, exp2, expm1, log 2; tanh, sigmoid 3; gamma below
 * (tests/tensor/test_elementwise.c measures them). NaN gives NaN, but 0 of gamma; everywhere results below FLT_MIN are
 * rounded denormals, never flushed, and results above FLT_MAX infinity. Polynomials are minimax fits (Remez) of the
 * expression that each comment names. Only files in this folder and in render/kernels include this. */
#ifndef TS_VMATH_H
#define TS_VMATH_H
#include "tensor/kernels/vec.h"

typedef uint32_t vu
    __attribute__((vector_size(VL * 4))); /* unsigned, so that a NaN's garbage exponent cannot overflow */

/* 2^n for -126 <= n <= 127 */
static inline vf v_power2(vi n) { return (vf)(((vu)n + 127u) << 23); }

/* p 2^n for -252 <= n <= 254, rounded once: two factors, for one alone would overflow or lose a denormal's bits twice
 */
static inline vf v_scale2(vf p, vi n)
{
    vi half = n >> 1;
    return p * v_power2(half) * v_power2(n - half);
}

/* Adding 1.5 2^23 leaves the integer nearest to |x| < 2^22 in the low bits (NaN leaves garbage, which callers multiply
 * by NaN). */
#define V_ROUND_MAGIC 12582912.0f

/* 2^x. Saturates: 0 from x < -150, infinity from x >= 128. */
static inline vf v_exp2(vf x)
{
    x = v_min(v_set(129.0f), v_max(v_set(-151.0f), x)); /* x second: NaN passes */
    vf t = x + V_ROUND_MAGIC;
    vi n = (vi)((vu)t - (vu)v_set(V_ROUND_MAGIC));
    vf f = x - (t - V_ROUND_MAGIC); /* exact, in [-1/2, 1/2] */
    /* 2^f = 1 + f Q(f) */
    vf q = v_set(0x1.449088p-13f);
    q = q * f + 0x1.5f4896p-10f;
    q = q * f + 0x1.3b29aap-7f;
    q = q * f + 0x1.c6aecep-5f;
    q = q * f + 0x1.ebfbe0p-3f;
    q = q * f + 0x1.62e430p-1f;
    return v_scale2(q * f + 1.0f, n);
}

/* x = n ln 2 + r, |r| <= ln 2 / 2; ln 2 in two parts, the first short enough for n times it to be exact (Cody and Waite
 * 1980) */
static inline vf v_reduce_ln2(vf x, vi *n)
{
    vf t = x * 1.44269504f + V_ROUND_MAGIC;
    *n = (vi)((vu)t - (vu)v_set(V_ROUND_MAGIC));
    t = t - V_ROUND_MAGIC;
    return (x - t * 0.693359375f) - t * -2.12194440e-4f;
}

/* e^x. Saturates: 0 from x < -104, infinity from x > 88.73. */
static inline vf v_exp(vf x)
{
    vi n;
    x = v_min(v_set(89.0f), v_max(v_set(-105.0f), x));
    vf r = v_reduce_ln2(x, &n);
    /* e^r = 1 + r + r^2 P(r) */
    vf p = v_set(0x1.6a234cp-10f);
    p = p * r + 0x1.123a6cp-7f;
    p = p * r + 0x1.5558f4p-5f;
    p = p * r + 0x1.555490p-3f;
    p = p * r + 0x1.fffffcp-2f;
    return v_scale2((p * (r * r) + r) + 1.0f, n);
}

/* e^x - 1, accurate near 0 too. */
static inline vf v_expm1(vf x)
{
    vi n;
    vf y = v_min(v_set(88.8f), v_max(v_set(-25.0f), x)); /* below: -1 to the last bit; above: infinity */
    vf r = v_reduce_ln2(y, &n);
    /* e^r - 1 = r + r^2 P(r) */
    vf p = v_set(0x1.6d99bep-10f);
    p = p * r + 0x1.122880p-7f;
    p = p * r + 0x1.555486p-5f;
    p = p * r + 0x1.5554aep-3f;
    p = p * r + 0.5f;
    p = p * (r * r) + r;
    vf half = v_power2((vi)((vu)n - 1u)); /* 2^(n-1), since 2^128 is not a float */
    vf e = 2.0f * (half * p + (half - 0.5f));
    return v_select(v_abs(x) < v_set(1e-8f), x, e); /* keeps -0 and every bit of a denormal */
}

/* ln x. -infinity at +-0, NaN below. */
static inline vf v_log(vf x)
{
    vi tiny = x < v_set(0x1p-126f);
    vf y = v_select(tiny, x * 0x1p23f, x);
    /* y = m 2^k, m in [sqrt 1/2, sqrt 2): 0x3f3504f3 is sqrt 1/2 */
    vi i = (vi)((vu)y - 0x3f3504f3u);
    vi k = (i >> 23) - (tiny & v_seti(23));
    vf f = (vf)((i & 0x7fffff) + 0x3f3504f3) - 1.0f;
    vf kf = __builtin_convertvector(k, vf);
    /* ln(1 + f) = f - f^2/2 + f^3 P(f) */
    vf p = v_set(0x1.145736p-4f);
    p = p * f - 0x1.de3bb0p-4f;
    p = p * f + 0x1.e6f066p-4f;
    p = p * f - 0x1.fc2218p-4f;
    p = p * f + 0x1.23376ap-3f;
    p = p * f - 0x1.555c4cp-3f;
    p = p * f + 0x1.99a4b6p-3f;
    p = p * f - 0x1.000006p-2f;
    p = p * f + 0x1.555548p-2f;
    vf ff = f * f;
    p = p * (ff * f) + kf * -2.12194440e-4f;
    p = p - 0.5f * ff;
    vf r = kf * 0.693359375f + (f + p);
    r = v_select(x < v_set(INFINITY), r, x); /* infinity and NaN: themselves */
    r = v_select(x == v_set(0.0f), v_set(-INFINITY), r);
    return v_select(x < v_set(0.0f), v_set(NAN), r);
}

/* tanh |x| = (e^(2|x|) - 1) / (e^(2|x|) + 1), with the sign of x */
static inline vf v_tanh(vf x)
{
    vf t = v_expm1(2.0f * v_min(v_set(9.1f), v_abs(x))); /* tanh 9.1 is 1 to the last bit */
    vf r = t / (t + 2.0f);
    return (vf)((vi)r | ((vi)x & (int32_t)0x80000000));
}

/* 1 / (1 + e^-x); by e^-|x| so that the tail towards 0 keeps its relative accuracy */
static inline vf v_sigmoid(vf x)
{
    vf e = v_exp(-v_abs(x));
    vf r = 1.0f / (1.0f + e);
    return v_select(x < v_set(0.0f), e * r, r);
}

/* clamp(x, 0, 1)^(1/2.2), within 80 units in the last place; NaN gives 0, as everything that is not above 0 does */
static inline vf v_gamma(vf x)
{
    vf y = v_exp(v_log(v_min(v_set(1.0f), x)) * (float)(1 / 2.2));
    return v_select(x > v_set(0.0f), y, (vf){0});
}
#endif
