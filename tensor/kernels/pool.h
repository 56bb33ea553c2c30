/* 2x2 maximum of one pair of rows, and its gradient. A NaN wins, so that it is not hidden. */
#ifndef TS_POOL_H
#define TS_POOL_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stdint.h>

struct ts_pool_kernels {
    /* row0, row1: [2 w][c], y: [w][c] */
    void (*max)(int w, int c, const float *row0, const float *row1, float *y);
    /* dy goes to the largest of the four, the first of equal ones in reading order; the others get 0. */
    void (*max_backward)(int w, int c, const float *row0, const float *row1, const float *dy, float *drow0,
                         float *drow1, bool accumulate);
};
TS_FAMILY(pool)

/* The same in plain C, for tests. */
extern const struct ts_pool_kernels ts_pool_naive;
#endif
