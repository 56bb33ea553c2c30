#include "train/mpi/rounded.h"
#include <string.h>

static uint16_t rounded(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    if ((bits & 0x7fffffffu) > 0x7f800000u) return (uint16_t)(bits >> 16 | 0x40); /* a NaN stays one */
    return (uint16_t)((bits + 0x7fffu + (bits >> 16 & 1)) >> 16);
}

static float wide(uint16_t v)
{
    const uint32_t bits = (uint32_t)v << 16;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

size_t tr_rounded_part(size_t count, int ranks) { return (count + (size_t)ranks - 1) / (size_t)ranks; }

void tr_round(const float *from, size_t count, size_t padded, uint16_t *to)
{
    for (size_t i = 0; i < count; i++) to[i] = rounded(from[i]);
    memset(to + count, 0, (padded - count) * sizeof *to);
}

void tr_round_sums(const uint16_t *from, int ranks, size_t part, uint16_t *to)
{
    enum { BLOCK = 512 };
    float sum[BLOCK];
    for (size_t at = 0; at < part; at += BLOCK) {
        const size_t n = part - at < BLOCK ? part - at : BLOCK;
        for (size_t i = 0; i < n; i++) sum[i] = wide(from[at + i]);
        for (int r = 1; r < ranks; r++)
            for (size_t i = 0; i < n; i++) sum[i] += wide(from[(size_t)r * part + at + i]);
        for (size_t i = 0; i < n; i++) to[at + i] = rounded(sum[i]);
    }
}

void tr_unround(const uint16_t *from, size_t count, float *to)
{
    for (size_t i = 0; i < count; i++) to[i] = wide(from[i]);
}
