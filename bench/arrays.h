/* What it takes to fetch a computation's arrays: where that is most of a row's time, the memory is its limit and not
 * the FMA peak. */
#ifndef BENCH_ARRAYS_H
#define BENCH_ARRAYS_H
#include "bench/bench.h"
#include <stdint.h>

typedef struct bench_arrays {
    const float *read[2];
    float *written;
    int64_t reads[2], writes;
    bool adds; /* to what was there, which is read too */
} bench_arrays;

/* Below a row, where it is a tenth of its time or more: how long all threads take to read and write the arrays once,
 * as warm as the row's calls leave them, which is the median of a third of a second's repetitions. */
void bench_row_arrays(bench_time t, bench_arrays *a);
#endif
