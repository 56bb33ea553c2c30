#include "tensor/kernels/pool.h"
#include "tensor/kernels/vec.h"

static inline vi wins(vf x, vf best) { return (x > best) | (x != x); }

static void max(int w, int c, const float *row0, const float *row1, float *y)
{
    for (int j = 0; j < w; j++, row0 += 2 * c, row1 += 2 * c, y += c)
        for (int i = 0; i < c; i += VL) {
            const int left = c - i;
            vf best = v_load_part(row0 + i, left), x = v_load_part(row0 + c + i, left);
            best = v_select(wins(x, best), x, best);
            x = v_load_part(row1 + i, left);
            best = v_select(wins(x, best), x, best);
            x = v_load_part(row1 + c + i, left);
            v_store_part(y + i, v_select(wins(x, best), x, best), left);
        }
}

static inline void put(float *p, vi mask, vf dy, int left, bool accumulate)
{
    vf d = (vf)(mask & (vi)dy);
    v_store_part(p, accumulate ? v_load_part(p, left) + d : d, left);
}

static void max_backward(int w, int c, const float *row0, const float *row1, const float *dy, float *drow0,
                         float *drow1, bool accumulate)
{
    for (int j = 0; j < w; j++, row0 += 2 * c, row1 += 2 * c, drow0 += 2 * c, drow1 += 2 * c, dy += c)
        for (int i = 0; i < c; i += VL) {
            const int left = c - i;
            vf best = v_load_part(row0 + i, left), d = v_load_part(dy + i, left);
            vf x1 = v_load_part(row0 + c + i, left), x2 = v_load_part(row1 + i, left),
               x3 = v_load_part(row1 + c + i, left);
            vi m1 = wins(x1, best);
            best = v_select(m1, x1, best);
            vi m2 = wins(x2, best);
            best = v_select(m2, x2, best);
            vi m3 = wins(x3, best);
            put(drow0 + i, ~(m1 | m2 | m3), d, left, accumulate);
            put(drow0 + c + i, m1 & ~(m2 | m3), d, left, accumulate);
            put(drow1 + i, m2 & ~m3, d, left, accumulate);
            put(drow1 + c + i, m3, d, left, accumulate);
        }
}

const struct ts_pool_kernels TS_TABLE(pool) = {.max = max, .max_backward = max_backward};
