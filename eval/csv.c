/* The report's files. */
#include "eval/html.h"
#include "eval/text.h"
#include "tensor/new_file.h"
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };

void ev_csv_number(FILE *f, double v)
{
    if (isnan(v)) fputc(',', f);
    else fprintf(f, ",%.6f", v);
}

static void put_column(const ev_report *r, int column, FILE *f)
{
    fputc(',', f);
    ev_csv_field(f, r->method[ev_report_method(r, column)].label);
    fprintf(f, ",%d", r->step[column]);
}

static void write_results(const void *what, FILE *f)
{
    const ev_report *r = what;
    fputs("set,material,method,step", f);
    for (int k = 0; k < EV_METRICS; k++) fprintf(f, ",%s", ev_metric_name[k]);
    fputc('\n', f);
    for (int i = 0; i < r->results; i++)
        for (int c = 0; c < r->columns; c++) {
            ev_csv_field(f, r->set_name[r->result[i].set]);
            fputc(',', f);
            ev_csv_field(f, r->result[i].material);
            put_column(r, c, f);
            for (int k = 0; k < EV_METRICS; k++) ev_csv_number(f, r->result[i].row[c].value[k]);
            fputc('\n', f);
        }
}

/* A line for each set (and for all when there are several) and column. */
static void write_lines(const ev_report *r, void (*put)(const ev_report *r, int set, int column, FILE *f), FILE *f)
{
    for (int set = 0; set <= r->sets; set++) {
        if (set == r->sets && r->sets == 1) continue; /* "all" would repeat it */
        for (int c = 0; c < r->columns; c++) {
            ev_row mean, deviation;
            const int which = set == r->sets ? -1 : set;
            if (ev_report_materials(r, which) == 0) continue;
            ev_csv_field(f, set == r->sets ? "all" : r->set_name[set]);
            fprintf(f, ",%d", ev_report_summary(r, which, c, &mean, &deviation));
            put_column(r, c, f);
            put(r, which, c, f);
            fputc('\n', f);
        }
    }
}

static void put_means(const ev_report *r, int set, int column, FILE *f)
{
    ev_row mean, deviation;
    ev_report_summary(r, set, column, &mean, &deviation);
    for (int k = 0; k < EV_METRICS; k++) ev_csv_number(f, mean.value[k]), ev_csv_number(f, deviation.value[k]);
}

static void put_times(const ev_report *r, int set, int column, FILE *f)
{
    const int m = ev_report_method(r, column);
    ev_csv_number(f, ev_report_seconds(r, set, column));
    ev_csv_number(f, 1e-9 * ev_report_peak(r, set, m));
    fprintf(f, ",%zu,%d", r->method[m].bytes, r->threads);
}

static void write_summary(const void *what, FILE *f)
{
    fputs("set,materials,method,step", f);
    for (int k = 0; k < EV_METRICS; k++) fprintf(f, ",%s_mean,%s_deviation", ev_metric_name[k], ev_metric_name[k]);
    fputc('\n', f);
    write_lines(what, put_means, f);
}

static void write_times(const void *what, FILE *f)
{
    fputs("set,materials,method,step,seconds,peak_gflops,bytes,threads\n", f);
    write_lines(what, put_times, f);
}

static void write_json(const void *what, FILE *f) { ev_json_write(what, f); }
static void write_html(const void *what, FILE *f) { ev_html_write(what, f); }

ts_code ev_replace(const char *folder, const char *name, void (*write_to)(const void *what, FILE *f), const void *what,
                   ts_status *st)
{
    char path[PATH_LENGTH];
    ts_new_file part;
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
    if (ts_new_file_begin(&part, path, st) != TS_OK) return st->code;
    const int copy = fcntl(part.fd, F_DUPFD_CLOEXEC, 0);
    FILE *f = copy < 0 ? NULL : fdopen(copy, "w");
    if (!f) part.error = errno;
    else {
        write_to(what, f);
        if (fflush(f) != 0 || ferror(f)) part.error = errno ? errno : EIO;
        if (fclose(f) != 0 && !part.error) part.error = errno;
    }
    if (!f && copy >= 0) close(copy);
    return ts_new_file_end(&part, TS_OK, st);
}

ts_code ev_report_write(const ev_report *r, const char *folder, ts_status *st)
{
    static const struct {
        const char *name;
        void (*write_to)(const void *, FILE *);
    } files[] = {{"results.csv", write_results},
                 {"summary.csv", write_summary},
                 {"times.csv", write_times},
                 {"results.json", write_json},
                 {"report.html", write_html}};
    ts_code code = TS_OK;
    for (size_t i = 0; i < sizeof files / sizeof *files && !code; i++)
        code = ev_replace(folder, files[i].name, files[i].write_to, r, st);
    return code;
}
