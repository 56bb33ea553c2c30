/* The noise kernels against their naive twin: the same bytes on every instruction set. */
#include "tensor/kernels/noise.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { MOST = 700 };
static float u[MOST], v[MOST], ours[6][MOST], theirs[6][MOST];

static int fill(ts_rng *r)
{
    const int n = ts_rng_int(r, 8) ? 1 + ts_rng_int(r, MOST - 1) : ts_rng_int(r, 20);
    const float reach = ts_rng_int(r, 2) ? 100.0f : 2.0f;
    for (int i = 0; i < MOST; i++) {
        u[i] = ts_rng_range(r, -reach, reach);
        v[i] = ts_rng_range(r, -reach, reach);
        if (ts_rng_int(r, 5) == 0) u[i] = (float)(int)u[i]; /* on the lattice */
        if (ts_rng_int(r, 5) == 0) v[i] = (float)(int)v[i];
    }
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < MOST; i++) ours[k][i] = theirs[k][i] = ts_rng_range(r, -1, 1);
    return n;
}

TEST(noise_kernels_match_their_naive_twin_exactly)
{
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_rng r = ts_rng_make(1, TS_STREAM_TEST, 0);
        ts_isa_use((ts_isa)isa);
        for (int trial = 0; trial < 300; trial++) {
            const int n = fill(&r), folded = ts_rng_int(&r, 2), left_out = ts_rng_int(&r, 6);
            const uint32_t seed = ts_rng_u32(&r);
            const float frequency = ts_rng_int(&r, 3) ? ts_rng_range(&r, 0.1f, 9) : 1,
                        shift = ts_rng_int(&r, 2) ? ts_rng_range(&r, 0, 64) : 0;
            const float amplitude = ts_rng_range(&r, -2, 2), stagger = ts_rng_int(&r, 2) ? 0.5f : 0,
                        jitter = ts_rng_int(&r, 3) ? ts_rng_uniform(&r) : 0;
            ts_noise_k()->octave(n, u, v, frequency, shift, -shift, seed, folded, amplitude, ours[5]);
            ts_noise_naive.octave(n, u, v, frequency, shift, -shift, seed, folded, amplitude, theirs[5]);
            const ts_noise_cells c = {frequency, jitter, stagger, seed};
            float *a[5], *b[5];
            for (int k = 0; k < 5; k++) {
                a[k] = k == left_out ? NULL : ours[k];
                b[k] = k == left_out ? NULL : theirs[k];
            }
            ts_noise_k()->cell(n, u, v, c, a[0], a[1], a[2], a[3], a[4]);
            ts_noise_naive.cell(n, u, v, c, b[0], b[1], b[2], b[3], b[4]);
            for (int k = 0; k < 6; k++)
                for (int i = 0; i < MOST; i++)
                    CHECK(!memcmp(&ours[k][i], &theirs[k][i], sizeof(float)),
                          "%s: output %d of point %d of %d (trial %d) is %.9g, not %.9g", ts_isa_name((ts_isa)isa), k,
                          i, n, trial, (double)ours[k][i], (double)theirs[k][i]);
        }
    }
}

TEST(noise_kernels_give_the_normal_numbers_of_the_stream)
{
    static float first[MOST], many[MOST];
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int trial = 0; trial < 200; trial++) {
            ts_rng a = ts_rng_make(11, TS_STREAM_TEST, (uint64_t)trial), b = a;
            const int before = trial % 5, n = trial * 37 % MOST; /* blocks are entered at every place */
            for (int i = 0; i < before; i++) CHECK(ts_rng_u32(&a) == ts_rng_u32(&b), "the same stream");
            ts_rng_normals(&a, n, many);
            for (int i = 0; i < n; i++) {
                const float one = ts_rng_normal(&b);
                CHECK(fabsf(many[i] - one) < 3e-4f, "%s: number %d of %d is %.9g, not %.9g", ts_isa_name((ts_isa)isa),
                      i, n, (double)many[i], (double)one);
            }
            CHECK(ts_rng_u32(&a) == ts_rng_u32(&b), "%s: %d numbers leave the stream elsewhere",
                  ts_isa_name((ts_isa)isa), n);
            if (trial != 18) continue;
            if (isa == 0) memcpy(first, many, sizeof first);
            CHECK(n > 600 && !memcmp(first, many, (size_t)n * sizeof *many),
                  "%s: other bytes than the first instruction set's", ts_isa_name((ts_isa)isa));
        }
    }
}
