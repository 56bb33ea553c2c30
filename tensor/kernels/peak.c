#include "tensor/kernels/peak.h"
#include "tensor/kernels/vec.h"

static double run(long rounds)
{
    /* Twelve chains: enough to hide the latency of two units, few enough for 16 registers. Each starts with a value of its own
     * that the compiler cannot know, or it would run one chain for all. */
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

const struct ts_peak_kernels TS_TABLE(peak) = {.run = run};
