#include "eval/report.h"
#include "render/error.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int ev_report_add(ev_report *r, int set, const char *material, ts_status *st)
{
    if (r->results == r->capacity) {
        const int capacity = r->capacity ? 2 * r->capacity : 64;
        ev_result *more = realloc(r->result, (size_t)capacity * sizeof *more);
        if (!more) return ts_fail(st, TS_NOMEM, "out of memory for the results"), -1;
        r->result = more;
        r->capacity = capacity;
    }
    const size_t columns = (size_t)r->columns, methods = (size_t)r->methods;
    ev_result *to = &r->result[r->results++];
    *to = (ev_result){.set = set,
                      .row = malloc(columns * sizeof *to->row),
                      .seconds = malloc(columns * sizeof *to->seconds),
                      .peak = malloc(methods * sizeof *to->peak),
                      .png = calloc(methods, sizeof *to->png),
                      .png_size = calloc(methods, sizeof *to->png_size)};
    snprintf(to->material, sizeof to->material, "%s", material);
    if (!to->row || !to->seconds || !to->peak || !to->png || !to->png_size)
        return ts_fail(st, TS_NOMEM, "out of memory for the results"), -1;
    for (int i = 0; i < r->columns; i++) {
        to->seconds[i] = NAN;
        for (int k = 0; k < EV_METRICS; k++) to->row[i].value[k] = NAN;
    }
    for (int m = 0; m < r->methods; m++) to->peak[m] = NAN;
    return r->results - 1;
}

void ev_report_free(ev_report *r)
{
    for (int i = 0; i < r->results; i++) {
        ev_result *m = &r->result[i];
        for (int k = 0; k < r->methods && m->png; k++) free(m->png[k]);
        free(m->row);
        free(m->seconds);
        free(m->peak);
        free(m->png);
        free(m->png_size);
    }
    free(r->result);
    r->result = NULL;
    r->results = r->capacity = 0;
}

static bool belongs(const ev_report *r, int set, int i) { return set < 0 || r->result[i].set == set; }
static bool is_estimated(const ev_report *r, int i, int column) { return !isnan(r->result[i].seconds[column]); }

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(const ev_report *r, int set, const double *(*of)(const ev_result *m), int index)
{
    double *all = malloc(((size_t)r->results + 1) * sizeof *all), middle = NAN;
    int n = 0;
    for (int i = 0; i < r->results && all; i++) {
        const double v = of(&r->result[i])[index];
        if (belongs(r, set, i) && !isnan(v)) all[n++] = v;
    }
    if (n) {
        qsort(all, (size_t)n, sizeof *all, by_size);
        middle = (all[n / 2] + all[(n - 1) / 2]) / 2;
    }
    free(all);
    return middle;
}

static const double *seconds_of(const ev_result *m) { return m->seconds; }
static const double *peak_of(const ev_result *m) { return m->peak; }

double ev_report_seconds(const ev_report *r, int set, int column) { return median(r, set, seconds_of, column); }
double ev_report_peak(const ev_report *r, int set, int method) { return median(r, set, peak_of, method); }

int ev_report_materials(const ev_report *r, int set)
{
    int n = 0;
    for (int i = 0; i < r->results; i++) n += belongs(r, set, i);
    return n;
}

int ev_report_summary(const ev_report *r, int set, int column, ev_row *mean, ev_row *deviation)
{
    int n = 0;
    for (int i = 0; i < r->results; i++) n += belongs(r, set, i) && is_estimated(r, i, column);
    for (int k = 0; k < EV_METRICS; k++) {
        int measured = 0;
        double sum = 0, squares = 0;
        for (int pass = 0; pass < 2; pass++) /* the mean first: differences from it lose no digits */
            for (int i = 0; i < r->results; i++) {
                const double v = r->result[i].row[column].value[k];
                if (!belongs(r, set, i) || isnan(v)) continue;
                if (pass == 0) sum += v, measured++;
                else squares += (v - sum / measured) * (v - sum / measured);
            }
        mean->value[k] = measured ? sum / measured : NAN;
        deviation->value[k] = measured > 1 ? sqrt(squares / (measured - 1)) : measured ? 0 : NAN;
    }
    if (!isnan(mean->value[EV_OVER_FLAT])) /* the quotient of the means: smooth materials do not decide it */
        mean->value[EV_OVER_FLAT] = mean->value[EV_NORMAL] / mean->value[EV_FLAT];
    return n;
}

int ev_report_method(const ev_report *r, int column)
{
    int m = 0;
    while (m + 1 < r->methods && r->method[m + 1].first <= column) m++;
    return m;
}

int ev_report_shown(const ev_report *r, int *column)
{
    int n = 0;
    for (int c = 0; c < r->columns; c++) {
        const ev_subject *m = &r->method[ev_report_method(r, c)];
        if (r->methods == 1 || c == m->first + m->points - 1) column[n++] = c;
    }
    return n;
}

const char *ev_report_name(const ev_report *r, int column, char name[EV_NAME])
{
    if (r->methods == 1) snprintf(name, EV_NAME, "R_%d", r->step[column]);
    else snprintf(name, EV_NAME, "%s", r->method[ev_report_method(r, column)].label);
    return name;
}

/* Whether two columns' means are of the same materials. */
static bool are_of_the_same(const ev_report *r, int set, int a, int b)
{
    for (int i = 0; i < r->results; i++)
        if (belongs(r, set, i) && is_estimated(r, i, a) != is_estimated(r, i, b)) return false;
    return true;
}

/* "-" where there is no number. */
static void put_number(FILE *out, int width, int digits, double v)
{
    if (isnan(v)) fprintf(out, "  %*s", width, "-");
    else fprintf(out, "  %*.*f", width, digits, v);
}

/* What the estimate's renderings are compared with, where they are. */
static void put_compared(const ev_report *r, int set, FILE *out)
{
    int captures = 0, known = 0, inputs = 1;
    for (int i = 0; i < r->results; i++) {
        const ev_sheet_shape *shape = &r->result[i].sheet;
        if (!belongs(r, set, i)) continue;
        captures += shape->kind == EV_SHEET_CAPTURE;
        known += shape->kind == EV_SHEET_MAPS;
        if (shape->kind == EV_SHEET_CAPTURE) inputs = shape->inputs;
    }
    if (known) fprintf(out, ", %d renderings each", RD_EVAL_VIEWS);
    if (known && captures) fputs(" of known maps", out);
    if (captures && inputs == 1)
        fputs(", each picture of a capture but the input, the nearest to the sample's axis", out);
    if (captures && inputs > 1)
        fprintf(out,
                ", each picture of a capture but the %d of the input: the nearest to the sample's axis and the "
                "first others",
                inputs);
}

/* The table's first lines; partial: some of the others are not of all materials. any: what any column has. */
static void print_head(const ev_report *r, int set, const ev_row *any, int width, bool partial, FILE *out)
{
    const int n = ev_report_materials(r, set);
    fprintf(out, "%s%s: %d %s, %d x %d pixels", set != 0 ? "\n" : "", set < 0 ? "all sets" : r->set_name[set], n,
            n == 1 ? "material" : "materials", r->size, r->size);
    put_compared(r, set, out);
    fprintf(out,
            "; RMSE (angle: degrees; ssim, flip, exposure, lpips: themselves), mean +- standard deviation; %d "
            "thread%s%s, seconds: median\n%*s",
            r->threads, r->threads == 1 ? "" : "s", r->pinned ? ", pinned" : "", width, "");
    if (partial) fputs("  materials", out);
    for (int k = 0; k < EV_METRICS; k++)
        if (!isnan(any->value[k])) fprintf(out, "  %-16s", ev_metric_name[k]);
    fputs("  render change  seconds  GFLOP/s peak      MB\n", out);
}

/* One set's table, or that of all with set = -1. */
static void print_table(const ev_report *r, int set, const int *column, int columns, FILE *out)
{
    ev_row mean, deviation, any = {{0}};
    char name[EV_NAME];
    int width = 5;
    bool partial = false;
    const int all = ev_report_materials(r, set);
    if (all == 0) return;
    for (int i = 0; i < columns; i++) { /* what no column has is no column of the table */
        const int length = (int)strlen(ev_report_name(r, column[i], name));
        partial = ev_report_summary(r, set, column[i], &mean, &deviation) != all || partial;
        if (length > width) width = length;
        for (int k = 0; k < EV_METRICS; k++)
            if (i == 0 || isnan(any.value[k])) any.value[k] = mean.value[k];
    }
    ev_report_summary(r, set, column[0], &mean, &deviation);
    const double start = mean.value[EV_RENDER];
    print_head(r, set, &any, width, partial, out);
    for (int i = 0; i < columns; i++) {
        const int m = ev_report_method(r, column[i]), n = ev_report_summary(r, set, column[i], &mean, &deviation);
        fprintf(out, "%-*s", width, ev_report_name(r, column[i], name));
        if (partial) fprintf(out, "  %9d", n);
        for (int k = 0; k < EV_METRICS; k++) {
            if (isnan(any.value[k])) continue;
            if (isnan(mean.value[k])) fprintf(out, "  %-16s", "-");
            else
                fprintf(out, k == EV_ANGLE || k == EV_EXPOSURE ? "  %6.2f +- %6.2f" : "  %.4f +- %.4f", mean.value[k],
                        deviation.value[k]);
        }
        if (start > 0 && !isnan(mean.value[EV_RENDER]) && are_of_the_same(r, set, column[0], column[i]))
            fprintf(out, "  %+12.1f%%", 100 * (mean.value[EV_RENDER] / start - 1));
        else fprintf(out, "  %13s", "-");
        put_number(out, 7, 3, ev_report_seconds(r, set, column[i]));
        put_number(out, 12, 0, 1e-9 * ev_report_peak(r, set, m));
        put_number(out, 6, 0, 1e-6 * (double)r->method[m].bytes);
        fputc('\n', out);
    }
}

void ev_report_print(const ev_report *r, FILE *out)
{
    int *column = malloc((size_t)r->columns * sizeof *column);
    const int columns = column ? ev_report_shown(r, column) : 0;
    for (int set = 0; set < r->sets && columns; set++) print_table(r, set, column, columns, out);
    if (r->sets > 1 && columns) print_table(r, -1, column, columns, out);
    free(column);
}
