/* The naive twin of tensor/kernels/pool.c. */
#include "tensor/kernels/pool.h"

/* Which of the four (0 .. 3 in reading order) is the maximum of output value i. */
static int winner(int c, int i, const float *row0, const float *row1, float *best)
{
    const int at = i / c * 2 * c + i % c;
    const float x[4] = {row0[at], row0[at + c], row1[at], row1[at + c]};
    int k = 0;
    for (int q = 1; q < 4; q++)
        if (x[q] > x[k] || x[q] != x[q]) k = q;
    *best = x[k];
    return k;
}

static void max(int w, int c, const float *row0, const float *row1, float *y)
{
    for (int i = 0; i < w * c; i++) winner(c, i, row0, row1, y + i);
}

static void max_backward(int w, int c, const float *row0, const float *row1, const float *dy, float *drow0,
                         float *drow1, bool accumulate)
{
    for (int i = 0; i < w * c; i++) {
        float best, *d = i % c + i / c * 2 * c + drow0, *e = i % c + i / c * 2 * c + drow1;
        int k = winner(c, i, row0, row1, &best);
        float g[4] = {0};
        g[k] = dy[i];
        d[0] = accumulate ? d[0] + g[0] : g[0];
        d[c] = accumulate ? d[c] + g[1] : g[1];
        e[0] = accumulate ? e[0] + g[2] : g[2];
        e[c] = accumulate ? e[c] + g[3] : g[3];
    }
}

const struct ts_pool_kernels ts_pool_naive = {.max = max, .max_backward = max_backward};
