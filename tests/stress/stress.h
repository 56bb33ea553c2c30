/* Stress of the numerics: each part prints rows "what | measured | bound" and says whether every bound held. lgd-stress
 * runs them in full (minutes), the test runner a short form. */
#ifndef STRESS_H
#define STRESS_H
#include "tests/support/farther.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct stress {
    bool full;
    const char *folder; /* an empty one, for the training run and photographs */
} stress;

bool stress_shading(const stress *s);
bool stress_newton(const stress *s);
bool stress_refinement(const stress *s);
bool stress_training(const stress *s);
bool stress_unrolled(const stress *s);
bool stress_sums(const stress *s);
bool stress_threads(const stress *s);
bool stress_sheets(const stress *s);

/* Prints a row; returns whether measured <= bound (NaN is not). bound INFINITY: printed, and only has to be finite. */
bool stress_row(const char *what, double measured, double bound);
#endif
