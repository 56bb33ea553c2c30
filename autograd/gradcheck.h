/* Gradients against central differences in double precision, and forward against its plain double twin. */
#ifndef AG_GRADCHECK_H
#define AG_GRADCHECK_H
#include "autograd/tape.h"

/* How an op's cases() asks for one check. build() puts the op on the tape with the given inputs (leaves made by the
 * checker from the double arrays rounded to float) and returns the op's output. */
typedef ag_value *(*ag_build)(ag_tape *tape, ag_value *const *in, const void *user);

typedef struct ag_case {
    const char *label; /* for messages, for example "3x3 replicate 1x1 image" */
    int inputs;
    ts_shape shape[AG_MAX_INPUTS];
    bool fixed[AG_MAX_INPUTS]; /* an input whose gradient is not defined or not offered */
    float lo, hi;              /* inputs are uniform in [lo, hi) */
    /* Names the points where the function has a kink: returns true when moving value i of input j by +-step may cross
     * one. NULL: smooth everywhere. Such values are excluded from the difference test (and counted), never tolerated.
     */
    bool (*kink)(const double *const *in, int input, int64_t i, double step, const void *user);
    /* Changes the random inputs to the edge that the case is about; NULL: none. */
    void (*prepare)(float *const *in, const void *user);
    ag_build build;
    const void *user;
    double forward_tolerance;  /* relative to the largest |output|; 0: 1e-5 */
    double gradient_tolerance; /* relative to the largest |gradient| of that input; 0: 1e-3 */
} ag_case;

/* The loss is a fixed random weighting of the outputs. Compares forward with op->reference and each analytic gradient
 * (all of them up to 64 values an input, a random choice of 64 beyond) with (f(x+h) - f(x-h)) / 2h of the double
 * reference. The label of a failing check and the worst value go to the status. */
ts_code ag_gradcheck_run(ag_gradcheck *check, const ag_case *c);

/* Random numbers for shapes and attributes of cases. */
ts_rng *ag_gradcheck_rng(ag_gradcheck *check);

/* Runs every op's cases (the list that make collects). report() gets a line per op. Returns the number of ops that
 * failed. */
int ag_gradcheck_all(uint64_t seed,
                     void (*report)(const char *op, int cases, int64_t compared, int64_t excluded, const ts_status *st,
                                    void *user),
                     void *user);
#endif
