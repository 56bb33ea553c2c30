#include "tensor/kernels/peak.h"
#include "tensor/kernels/vec.h"

static double run(long rounds)
{
    /* Twelve chains: enough to hide the latency of two units, few enough for 16 registers. Each starts with a value of
     * its own that the compiler cannot know, or it would run one chain for all. */
    volatile float seed = 1;
    vf a0 = v_set(seed), a1 = v_set(seed), a2 = v_set(seed), a3 = v_set(seed), a4 = v_set(seed), a5 = v_set(seed);
    vf a6 = v_set(seed), a7 = v_set(seed), a8 = v_set(seed), a9 = v_set(seed), a10 = v_set(seed), a11 = v_set(seed);
    const vf m = v_set(0.999f), s = v_set(0.001f);
    for (long i = 0; i < rounds; i++) {
        a0 = a0 * m + s, a1 = a1 * m + s, a2 = a2 * m + s, a3 = a3 * m + s, a4 = a4 * m + s, a5 = a5 * m + s;
        a6 = a6 * m + s, a7 = a7 * m + s, a8 = a8 * m + s, a9 = a9 * m + s, a10 = a10 * m + s, a11 = a11 * m + s;
    }
    const vf all = ((a0 + a1) + (a2 + a3)) + ((a4 + a5) + (a6 + a7)) + ((a8 + a9) + (a10 + a11));
    volatile float keep = v_sum(all); /* or the loop would be removed */
    (void)keep;
    return 12.0 * 2 * VL * (double)rounds;
}

#if defined(__AMX_BF16__)
#include "tensor/kernels/amx.h"

static double run_bf16(long rounds)
{
    tiles_begin();
    for (long i = 0; i < rounds; i++) {
        _tile_dpbf16ps(0, 4, 6);
        _tile_dpbf16ps(1, 4, 7);
        _tile_dpbf16ps(2, 5, 6);
        _tile_dpbf16ps(3, 5, 7);
    }
    tiles_end();
    return 4.0 * 2 * 16 * 16 * 32 * (double)rounds;
}
#elif defined(__AVX512BF16__)
static double run_bf16(long rounds)
{
    enum { CHAINS = 24 };    /* twelve do not hide this instruction's latency, and there are 32 registers */
    volatile float seed = 1; /* as above */
    vf a[CHAINS];
    const __m512bh one = (__m512bh)v_set(seed);
    _Pragma("GCC unroll 24") for (int c = 0; c < CHAINS; c++) a[c] = v_set(seed);
    for (long i = 0; i < rounds; i++)
        _Pragma("GCC unroll 24") for (int c = 0; c < CHAINS; c++) a[c] = (vf)_mm512_dpbf16_ps((__m512)a[c], one, one);
    vf all = a[0];
    _Pragma("GCC unroll 24") for (int c = 1; c < CHAINS; c++) all += a[c];
    volatile float keep = v_sum(all);
    (void)keep;
    return CHAINS * 4.0 * VL * (double)rounds;
}
#endif

#if defined(__AVX512BF16__)
const struct ts_peak_kernels TS_TABLE(peak) = {.run = run, .run_bf16 = run_bf16};
#else
const struct ts_peak_kernels TS_TABLE(peak) = {.run = run};
#endif
