/* Scores of all materials, as a table, CSV files and a report. */
#ifndef EV_REPORT_H
#define EV_REPORT_H
#include "eval/metrics.h"
#include <stdio.h>

typedef struct ev_result {
    int set;
    char material[128];
    ev_row *row;     /* steps + 1 */
    double *seconds; /* steps + 1: from the photograph to R_t */
    unsigned char *png; /* a picture for the report, or NULL */
    size_t png_size;
} ev_result;

typedef struct ev_report {
    int steps, sets, size, threads;
    const char *const *set_name; /* the caller's, as the other names */
    const char *model, *isa;
    ev_result *result;
    int results, room;
} ev_report;

/* Copies rows and seconds 0 .. steps; takes the picture (malloced, may be NULL), also after a failure. */
ts_code ev_report_add(ev_report *r, int set, const char *material, const ev_row *row, const double *seconds, unsigned char *png, size_t png_size, ts_status *st);
void ev_report_free(ev_report *r);

/* Mean and (with n - 1) standard deviation over the materials of a set, or of all sets with set = -1, that have the number (NaN: none has);
 * how many materials there are. */
int ev_report_summary(const ev_report *r, int set, int step, ev_row *mean, ev_row *deviation);

/* Median over the materials of a set (-1: of all) of the seconds to R_step; NaN when there is none. */
double ev_report_seconds(const ev_report *r, int set, int step);

/* For each set, and for all together when there are several: a line a step, and how far the renderings' error is from R_0's. */
void ev_report_print(const ev_report *r, FILE *out);

/* folder/results.csv: a line for each material and step; folder/summary.csv: a line for each set and step; results.json;
 * report.html (eval/html.h). Each is replaced as a whole. results.csv and summary.csv hold no times: they are the same bytes for the same seed. */
ts_code ev_report_write(const ev_report *r, const char *folder, ts_status *st);
#endif
