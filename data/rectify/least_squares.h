/* Small nonlinear least squares in double. */
#ifndef IO_LEAST_SQUARES_H
#define IO_LEAST_SQUARES_H
#include "tensor/status.h"
#include <stdbool.h>

/* Solves the symmetric positive definite system a x = b by Cholesky's factorisation; a [n][n] is destroyed, x holds b
 * before and the solution after. False: a is not positive definite (relative to its diagonal, to 1e-13). */
bool io_solve_symmetric(int n, double *a, double *x);

/* Levenberg and Marquardt's method (More, "The Levenberg-Marquardt Algorithm", 1978, with the diagonal of J^T J as the
 * scale): makes the sum of the squares of count residuals least over n unknowns x, from their start to where a step
 * changes it by less than 1e-12 of it, 100 steps at most. The derivatives are central differences of width step[i].
 * TS_NOMEM, or TS_NUMERIC where the start has residuals that are not finite. *rms (may be NULL): of the residuals. */
typedef struct io_problem {
    int n, count;
    const double *step; /* [n] */
    void (*residuals)(const double *x, double *residual, void *user);
    void *user;
} io_problem;
ts_code io_least_squares(const io_problem *p, double *x, double *rms, ts_status *st);
#endif
