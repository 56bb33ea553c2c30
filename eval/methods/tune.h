/* The search for a method's best settings: every combination of its grid on the given sets. */
#ifndef EV_TUNE_H
#define EV_TUNE_H
#include "eval/run.h"

typedef struct ev_tuning {
    ev_estimator *method; /* owned: every combination but of steps, which one run of the most has all of */
    int *of;              /* owned: which of the specs each belongs to */
    int methods, capacity;
} ev_tuning;

/* Whether it is searched where no method is named: it has a grid, and needs no weights of its own. */
bool ev_tune_by_default(const ev_method *m);

/* Adds all combinations of the grid of spec (NAME[:key=value,...]; what is given is not searched), each with a label of
 * its own: TS_INVALID for a label that is there already or gets too long. */
ts_code ev_tune_add(ev_tuning *t, const char *spec, int of, const char *model, ts_status *st);
void ev_tune_free(ev_tuning *t);

/* tune.csv: a line for each combination and number of steps. */
ts_code ev_tune_write(const ev_report *r, const char *folder, ts_status *st);
/* For each of the specs how many settings were tried, and the best by the renderings' mean error. A setting with which
 * a material failed is not the best. */
void ev_tune_print(const ev_tuning *t, const ev_report *r, FILE *out);
#endif
