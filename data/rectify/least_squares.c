#include "data/rectify/least_squares.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool io_solve_symmetric(int n, double *a, double *x)
{
    for (int j = 0; j < n; j++) {
        const double diagonal = a[j * n + j];
        for (int k = 0; k < j; k++) a[j * n + j] -= a[j * n + k] * a[j * n + k];
        if (!(a[j * n + j] > 1e-13 * diagonal) || !(diagonal > 0)) return false;
        a[j * n + j] = sqrt(a[j * n + j]);
        for (int i = j + 1; i < n; i++) {
            for (int k = 0; k < j; k++) a[i * n + j] -= a[i * n + k] * a[j * n + k];
            a[i * n + j] /= a[j * n + j];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) x[i] -= a[i * n + k] * x[k];
        x[i] /= a[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) x[i] -= a[k * n + i] * x[k];
        x[i] /= a[i * n + i];
    }
    return true;
}

typedef struct work {
    double *now, *moved, *jacobian /* [count][n] */, *normal, *damped, *gradient, *step, *next;
} work;

static double sum_of_squares(int count, const double *r)
{
    double sum = 0;
    for (int i = 0; i < count; i++) sum += r[i] * r[i];
    return sum;
}

/* normal = J^T J, gradient = J^T r. A residual depends on few of the unknowns: zeros are skipped. */
static void linearise(const io_problem *p, double *x, work *w)
{
    const int n = p->n;
    for (int j = 0; j < n; j++) {
        const double at = x[j];
        x[j] = at + p->step[j];
        p->residuals(x, w->moved, p->user);
        for (int i = 0; i < p->count; i++) w->jacobian[i * n + j] = w->moved[i];
        x[j] = at - p->step[j];
        p->residuals(x, w->moved, p->user);
        for (int i = 0; i < p->count; i++)
            w->jacobian[i * n + j] = (w->jacobian[i * n + j] - w->moved[i]) / (2 * p->step[j]);
        x[j] = at;
    }
    memset(w->normal, 0, (size_t)n * (size_t)n * sizeof *w->normal);
    memset(w->gradient, 0, (size_t)n * sizeof *w->gradient);
    for (int i = 0; i < p->count; i++) {
        const double *row = w->jacobian + i * n;
        for (int j = 0; j < n; j++) {
            if (row[j] == 0) continue;
            w->gradient[j] += row[j] * w->now[i];
            for (int k = 0; k <= j; k++) w->normal[j * n + k] += row[j] * row[k];
        }
    }
}

/* One accepted step, or false: none makes it less. */
static bool improve(const io_problem *p, double *x, double *sum, double *damping, work *w)
{
    const int n = p->n;
    linearise(p, x, w);
    for (; *damping < 1e12; *damping *= 8) {
        memcpy(w->damped, w->normal, (size_t)n * (size_t)n * sizeof *w->damped);
        for (int j = 0; j < n; j++) {
            w->damped[j * n + j] += *damping * w->normal[j * n + j] + 1e-300;
            w->step[j] = -w->gradient[j];
        }
        if (!io_solve_symmetric(n, w->damped, w->step)) continue;
        for (int j = 0; j < n; j++) w->next[j] = x[j] + w->step[j];
        p->residuals(w->next, w->moved, p->user);
        const double next = sum_of_squares(p->count, w->moved);
        if (!(next < *sum)) continue;
        const bool goes_on = *sum - next > 1e-12 * *sum;
        memcpy(x, w->next, (size_t)n * sizeof *x);
        memcpy(w->now, w->moved, (size_t)p->count * sizeof *w->now);
        *sum = next;
        *damping = fmax(*damping / 10, 1e-12);
        return goes_on;
    }
    return false;
}

ts_code io_least_squares(const io_problem *p, double *x, double *rms, ts_status *st)
{
    const size_t n = (size_t)p->n, count = (size_t)p->count;
    double *all = malloc((2 * count + count * n + 2 * n * n + 3 * n) * sizeof *all), damping = 1e-3;
    if (!all) return ts_fail(st, TS_NOMEM, "out of memory for %d unknowns", p->n);
    work w = {.now = all, .moved = all + count, .jacobian = all + 2 * count};
    w.normal = w.jacobian + count * n, w.damped = w.normal + n * n;
    w.gradient = w.damped + n * n, w.step = w.gradient + n, w.next = w.step + n;
    p->residuals(x, w.now, p->user);
    double sum = sum_of_squares(p->count, w.now);
    const ts_code code = isfinite(sum) ? TS_OK : ts_fail(st, TS_NUMERIC, "the start of the fit is not finite");
    for (int i = 0; i < 100 && !code && improve(p, x, &sum, &damping, &w); i++) {
    }
    if (rms) *rms = sqrt(sum / (double)p->count);
    free(all);
    return code;
}
