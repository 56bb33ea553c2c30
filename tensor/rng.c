#include "tensor/rng.h"
#include "tensor/kernels/noise.h"
#include <math.h>

static void philox(const uint32_t key[2], const uint32_t counter[4], uint32_t out[4])
{
    uint32_t k0 = key[0], k1 = key[1], c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    for (int round = 0; round < 10; round++) {
        const uint64_t p0 = (uint64_t)0xD2511F53u * c0, p1 = (uint64_t)0xCD9E8D57u * c2;
        const uint32_t n0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0, n2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
        c1 = (uint32_t)p1;
        c3 = (uint32_t)p0;
        c0 = n0;
        c2 = n2;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

ts_rng ts_rng_make(uint64_t seed, uint32_t stream, uint64_t index)
{
    ts_rng r = {.key = {(uint32_t)seed, (uint32_t)(seed >> 32)},
                .counter = {0, stream, (uint32_t)index, (uint32_t)(index >> 32)}};
    return r;
}

uint32_t ts_rng_u32(ts_rng *r)
{
    if (r->left == 0) {
        philox(r->key, r->counter, r->block);
        r->counter[0]++;
        r->left = 4;
    }
    return r->block[4 - r->left--];
}

float ts_rng_uniform(ts_rng *r) { return (float)(ts_rng_u32(r) >> 8) * 0x1p-24f; }

float ts_rng_range(ts_rng *r, float lo, float hi)
{
    const float v = lo + (hi - lo) * ts_rng_uniform(r);
    return v < hi ? v : lo; /* rounding may reach hi */
}

int ts_rng_int(ts_rng *r, int n) { return (int)(((uint64_t)ts_rng_u32(r) * (uint64_t)n) >> 32); }

float ts_rng_normal(ts_rng *r)
{
    const double u = ((double)ts_rng_u32(r) + 1.0) * 0x1p-32, v = (double)ts_rng_u32(r) * 0x1p-32;
    return (float)(sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v));
}

void ts_rng_normals(ts_rng *r, int64_t n, float *out)
{
    int64_t i = 0;
    for (; i < n && r->left > 0; i++)
        out[i] = ts_rng_normal(r); /* to the next block, or never there where one number of a block is left */
    const int64_t blocks = (n - i) / 2;
    ts_noise_k()->normal(blocks, r->key, r->counter, out + i);
    r->counter[0] += (uint32_t)blocks;
    for (i += 2 * blocks; i < n; i++) out[i] = ts_rng_normal(r);
}
