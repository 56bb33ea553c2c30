/* Scores of all materials, as a table and as CSV files. */
#ifndef EV_REPORT_H
#define EV_REPORT_H
#include "eval/metrics.h"
#include <stdio.h>

typedef struct ev_result {
    int set;
    char material[128];
    ev_row *row; /* steps + 1 */
} ev_result;

typedef struct ev_report {
    int steps, sets;
    const char *const *set_name; /* the caller's */
    ev_result *result;
    int results, room;
} ev_report;

/* Copies rows 0 .. steps. */
ts_code ev_report_add(ev_report *r, int set, const char *material, const ev_row *row, ts_status *st);
void ev_report_free(ev_report *r);

/* Mean and (with n - 1) standard deviation over the materials of a set, or of all sets with set = -1, that have the number (NaN: none has);
 * how many materials there are. */
int ev_report_summary(const ev_report *r, int set, int step, ev_row *mean, ev_row *deviation);

/* For each set, and for all together when there are several: a line a step, and how far the renderings' error is from R_0's. */
void ev_report_print(const ev_report *r, int size, FILE *out);

/* folder/results.csv: a line for each material and step; folder/summary.csv: a line for each set and step. Each is replaced as a whole. */
ts_code ev_report_write(const ev_report *r, const char *folder, ts_status *st);
#endif
