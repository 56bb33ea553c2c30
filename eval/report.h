/* Scores of all materials, as a table, CSV files and a report. */
#ifndef EV_REPORT_H
#define EV_REPORT_H
#include "eval/sheet.h"
#include <stdint.h>
#include <stdio.h>

/* A method's results: columns first .. first + points - 1 of every material. */
typedef struct ev_subject {
    const char *label; /* the caller's */
    int first, points;
    size_t bytes; /* its peak of memory */
} ev_subject;

typedef struct ev_result {
    int set;
    int64_t number; /* of the material in all sets */
    int method;     /* the first that has a result */
    char material[128];
    ev_row *row;         /* a column each; NaN: not estimated */
    double *seconds;     /* from the photograph to that step; NaN likewise */
    double *peak;        /* a method each: FLOP/s that the machine could do beside it */
    unsigned char **png; /* a method each: a picture for the report, or NULL; owned */
    size_t *png_size;
    ev_sheet_shape sheet; /* of the pictures */
} ev_result;

typedef struct ev_report {
    int sets, size, threads, repeat;
    bool pinned, exact;
    const char *const *set_name; /* the caller's, as the other names */
    const char *model, *isa;
    ev_subject *method; /* the caller's */
    int methods;
    int *step; /* of each column; the caller's */
    int columns;
    ev_result *result;
    int results, capacity;
} ev_report;

/* A material with nothing measured yet: its index in r->result, -1 with st. */
int ev_report_add(ev_report *r, int set, const char *material, ts_status *st);
void ev_report_free(ev_report *r);

/* How many materials of a set, or of all sets with set = -1, have been estimated by any method. */
int ev_report_materials(const ev_report *r, int set);

/* Mean and (with n - 1) standard deviation over the materials of a set, or of all sets with set = -1, that have the
 * number (NaN: none has); how many of them the column's method has estimated. */
int ev_report_summary(const ev_report *r, int set, int column, ev_row *mean, ev_row *deviation);

/* Medians over the materials of a set (-1: of all) of the seconds to a column, and of the FLOP/s beside a method; NaN
 * when there are none. */
double ev_report_seconds(const ev_report *r, int set, int column);
double ev_report_peak(const ev_report *r, int set, int method);

/* The columns of tables: every step of a single method, the last step of each of several. Column numbers into column[];
 * how many. A column's name: "R_3" or the method's label. */
enum { EV_NAME = 80 };
int ev_report_shown(const ev_report *r, int *column);
const char *ev_report_name(const ev_report *r, int column, char name[EV_NAME]);
int ev_report_method(const ev_report *r, int column);

/* For each set, and for all together when there are several: a line for each shown column, and how far the renderings'
 * error is from the first's where both are of the same materials. Where a line is not of all materials of the table,
 * each says of how many it is. */
void ev_report_print(const ev_report *r, FILE *out);

/* folder/results.csv: a line for each material, method and step; folder/summary.csv: a line for each set, method and
 * step; times.csv: their times and memory; results.json; report.html (eval/html.h). Each is replaced as a whole.
 * results.csv and summary.csv hold no times: they are the same bytes for the same seed. */
ts_code ev_report_write(const ev_report *r, const char *folder, ts_status *st);

/* Writes folder/name by write_to, as a whole or not at all. */
ts_code ev_replace(const char *folder, const char *name, void (*write_to)(const void *what, FILE *f), const void *what,
                   ts_status *st);
/* ",NUMBER", empty for what was not measured. */
void ev_csv_number(FILE *f, double v);
#endif
