/* C = alpha A B + beta C, row-major, float32, threaded; the same bytes for any number of threads
 * (0: the process's number). */
#ifndef TS_GEMM_H
#define TS_GEMM_H
#include <stdbool.h>

/* a: [m][k] (or [k][m] when ta), b: [k][n] (or [n][k] when tb), c: [m][n]; all contiguous. beta = 0 never reads c. */
void ts_gemm(bool ta, bool tb, int m, int n, int k, float alpha, const float *a, const float *b, float beta, float *c,
             int threads);
void ts_gemm_naive(bool ta, bool tb, int m, int n, int k, float alpha, const float *a, const float *b, float beta,
                   float *c);
#endif
