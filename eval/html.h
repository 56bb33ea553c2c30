/* The report: one self-contained HTML file. */
#ifndef EV_HTML_H
#define EV_HTML_H
#include "eval/report.h"

/* A page with the table, the plot of time against error, and for each material its numbers and picture, sortable by
 * each error. Its policy forbids loads from outside. When it has loaded, <body data-failed> is the number of
 * pictures and scripts that failed and report.html#METRIC is sorted by that metric (<body data-sorted>). */
void ev_html_write(const ev_report *r, FILE *f);

/* The same numbers for programs: results.json. What was not measured is null. */
void ev_json_write(const ev_report *r, FILE *f);
#endif
