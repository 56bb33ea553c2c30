#include "tensor/conv/gemm.h"
#include "tensor/cpu.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static float *values(size_t count, ts_rng *r)
{
    float *p = malloc(count * sizeof(float));
    CHECK(p, "no memory");
    for (size_t i = 0; i < count; i++) p[i] = ts_rng_range(r, -1, 1);
    return p;
}

static void check(bool ta, bool tb, int m, int n, int k, float alpha, float beta, ts_rng *r)
{
    enum { GUARD = 64 };
    const size_t count = (size_t)m * (size_t)n;
    float *a = values((size_t)m * (size_t)k, r), *b = values((size_t)k * (size_t)n, r),
          *naive = values(count + 2 * GUARD, r);
    float *fast = malloc((count + 2 * GUARD) * sizeof(float));
    CHECK(fast, "no memory");
    if (beta == 0)
        for (size_t i = 0; i < count; i++) naive[GUARD + i] = NAN; /* never read */
    memcpy(fast, naive, (count + 2 * GUARD) * sizeof(float));
    ts_gemm(ta, tb, m, n, k, alpha, a, b, beta, fast + GUARD, 0);
    ts_gemm_naive(ta, tb, m, n, k, alpha, a, b, beta, naive + GUARD);
    for (size_t i = 0; i < count + 2 * GUARD; i++) {
        const bool guard = i < GUARD || i >= count + GUARD;
        CHECK(fabs((double)fast[i] - naive[i]) <= (guard ? 0 : 2e-7 * (4 + 2 * k)),
              "%s: %d x %d x %d%s%s, alpha %g, beta %g: value %td is %.9g, naive %.9g", ts_isa_name(ts_isa_now()), m, n,
              k, ta ? " ta" : "", tb ? " tb" : "", alpha, beta, (ptrdiff_t)i - GUARD, fast[i], naive[i]);
    }
    free(a);
    free(b);
    free(naive);
    free(fast);
}

TEST(gemm_naive)
{
    static const int sizes[] = {1, 2, 3, 5, 8, 13, 14, 15, 16, 17, 31, 33, 64, 65, 113, 130};
    static const float alphas[] = {1, -0.5f}, betas[] = {0, 1, 0.25f};
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 200; i++)
            check(ts_rng_int(&r, 2), ts_rng_int(&r, 2), sizes[ts_rng_int(&r, 16)], sizes[ts_rng_int(&r, 16)],
                  sizes[ts_rng_int(&r, 16)], alphas[ts_rng_int(&r, 2)], betas[ts_rng_int(&r, 3)], &r);
        for (int t = 0; t < 4; t++) check(t & 1, t & 2, 5, 7, 2100, 1, 0.25f, &r); /* deeper than one block */
    }
}

TEST(gemm_same_bytes_for_any_threads)
{
    static const int threads[] = {1, 2, 3, 7};
    ts_rng r = ts_rng_make(2, TS_STREAM_TEST, 0);
    const int m = 130, n = 70, k = 1100;
    float *a = values((size_t)m * (size_t)k, &r), *b = values((size_t)k * (size_t)n, &r);
    float *c = values((size_t)(m * n), &r), *first = values((size_t)(m * n), &r);
    for (int t = 0; t < 4; t++) {
        ts_threads_set(threads[t]);
        ts_gemm(true, false, m, n, k, 1, a, b, 0, t == 0 ? first : c, 0);
        CHECK(t == 0 || memcmp(first, c, sizeof(float) * (size_t)(m * n)) == 0, "other bytes with %d threads",
              threads[t]);
    }
    free(a);
    free(b);
    free(c);
    free(first);
}
