#include "eval/report.h"
#include "eval/html.h"
#include "render/error.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };

ts_code ev_report_add(ev_report *r, int set, const char *material, const ev_row *row, const double *seconds, unsigned char *png, size_t png_size, ts_status *st)
{
    if (r->results == r->room) {
        const int room = r->room ? 2 * r->room : 64;
        ev_result *more = realloc(r->result, (size_t)room * sizeof *more);
        if (!more) {
            free(png);
            return ts_fail(st, TS_NOMEM, "out of memory for the results");
        }
        r->result = more;
        r->room = room;
    }
    const size_t rows = (size_t)r->steps + 1;
    ev_result *to = &r->result[r->results++];
    *to = (ev_result){.set = set, .row = malloc(rows * sizeof *row), .seconds = malloc(rows * sizeof *seconds), .png = png, .png_size = png_size};
    if (!to->row || !to->seconds) {
        r->results--;
        free(to->row);
        free(to->seconds);
        free(png);
        return ts_fail(st, TS_NOMEM, "out of memory for the results");
    }
    snprintf(to->material, sizeof to->material, "%s", material);
    memcpy(to->row, row, rows * sizeof *row);
    memcpy(to->seconds, seconds, rows * sizeof *seconds);
    return TS_OK;
}

void ev_report_free(ev_report *r)
{
    for (int i = 0; i < r->results; i++) {
        free(r->result[i].row);
        free(r->result[i].seconds);
        free(r->result[i].png);
    }
    free(r->result);
    r->result = NULL;
    r->results = r->room = 0;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double ev_report_seconds(const ev_report *r, int set, int step)
{
    double *all = malloc(((size_t)r->results + 1) * sizeof *all), median = NAN;
    int n = 0;
    for (int i = 0; i < r->results && all; i++)
        if (set < 0 || r->result[i].set == set) all[n++] = r->result[i].seconds[step];
    if (n) {
        qsort(all, (size_t)n, sizeof *all, by_size);
        median = (all[n / 2] + all[(n - 1) / 2]) / 2;
    }
    free(all);
    return median;
}

int ev_report_summary(const ev_report *r, int set, int step, ev_row *mean, ev_row *deviation)
{
    int n = 0;
    for (int i = 0; i < r->results; i++) n += set < 0 || r->result[i].set == set;
    for (int k = 0; k < EV_METRICS; k++) {
        int measured = 0;
        double sum = 0, squares = 0;
        for (int pass = 0; pass < 2; pass++) /* the mean first: differences from it lose no digits */
            for (int i = 0; i < r->results; i++) {
                const double v = r->result[i].row[step].value[k];
                if ((set >= 0 && r->result[i].set != set) || isnan(v)) continue;
                if (pass == 0) sum += v, measured++;
                else squares += (v - sum / measured) * (v - sum / measured);
            }
        mean->value[k] = measured ? sum / measured : NAN;
        deviation->value[k] = measured > 1 ? sqrt(squares / (measured - 1)) : measured ? 0 : NAN;
    }
    return n;
}

void ev_report_print(const ev_report *r, FILE *out)
{
    for (int set = 0; set <= r->sets; set++) {
        const bool all = set == r->sets;
        ev_row mean, deviation;
        const int n = ev_report_summary(r, all ? -1 : set, 0, &mean, &deviation);
        if (n == 0 || (all && r->sets == 1)) continue;
        const ev_row any = mean; /* what R_0 has not, no step has */
        const double start = mean.value[EV_RENDER];
        fprintf(out, "%s%s: %d %s, %d x %d pixels", set > 0 ? "\n" : "", all ? "all sets" : r->set_name[set], n, n == 1 ? "material" : "materials", r->size, r->size);
        if (isnan(mean.value[EV_DIFFUSE])) fputs(", each picture but the first", out);
        else if (isnan(mean.value[EV_EXPOSURE])) fprintf(out, ", %d renderings each", RD_EVAL_VIEWS);
        fputs("; RMSE (angle: degrees; ssim, flip, exposure, lpips: themselves), mean +- standard deviation\n     ", out);
        for (int k = 0; k < EV_METRICS; k++)
            if (!isnan(mean.value[k])) fprintf(out, "  %-16s", ev_metric_name[k]);
        fputs("  render change  seconds\n", out);
        for (int t = 0; t <= r->steps; t++) {
            ev_report_summary(r, all ? -1 : set, t, &mean, &deviation);
            fprintf(out, "R_%-3d", t);
            for (int k = 0; k < EV_METRICS; k++) {
                if (isnan(any.value[k])) continue;
                if (isnan(mean.value[k])) fprintf(out, "  %-16s", "-");
                else fprintf(out, k == EV_ANGLE || k == EV_EXPOSURE ? "  %6.2f +- %6.2f" : "  %.4f +- %.4f", mean.value[k], deviation.value[k]);
            }
            fprintf(out, "  %+12.1f%%  %7.3f\n", start > 0 ? 100 * (mean.value[EV_RENDER] / start - 1) : 0, ev_report_seconds(r, all ? -1 : set, t));
        }
    }
}

/* RFC 4180: in quotes when it has to be, quotes doubled. */
static void put_field(FILE *f, const char *text)
{
    if (!strpbrk(text, ",\"\r\n")) {
        fputs(text, f);
        return;
    }
    fputc('"', f);
    for (; *text; text++) {
        if (*text == '"') fputc('"', f);
        fputc(*text, f);
    }
    fputc('"', f);
}

/* What was not measured is empty. */
static void put_number(FILE *f, double v)
{
    if (isnan(v)) fputc(',', f);
    else fprintf(f, ",%.6f", v);
}

static void write_results(const ev_report *r, FILE *f)
{
    fputs("set,material,step", f);
    for (int k = 0; k < EV_METRICS; k++) fprintf(f, ",%s", ev_metric_name[k]);
    fputc('\n', f);
    for (int i = 0; i < r->results; i++)
        for (int t = 0; t <= r->steps; t++) {
            put_field(f, r->set_name[r->result[i].set]);
            fputc(',', f);
            put_field(f, r->result[i].material);
            fprintf(f, ",%d", t);
            for (int k = 0; k < EV_METRICS; k++) put_number(f, r->result[i].row[t].value[k]);
            fputc('\n', f);
        }
}

static void write_summary(const ev_report *r, FILE *f)
{
    fputs("set,materials,step", f);
    for (int k = 0; k < EV_METRICS; k++) fprintf(f, ",%s_mean,%s_deviation", ev_metric_name[k], ev_metric_name[k]);
    fputc('\n', f);
    for (int set = 0; set <= r->sets; set++) {
        if (set == r->sets && r->sets == 1) continue; /* "all" would repeat it */
        for (int t = 0; t <= r->steps; t++) {
            ev_row mean, deviation;
            const int n = ev_report_summary(r, set == r->sets ? -1 : set, t, &mean, &deviation);
            if (n == 0) continue;
            put_field(f, set == r->sets ? "all" : r->set_name[set]);
            fprintf(f, ",%d,%d", n, t);
            for (int k = 0; k < EV_METRICS; k++) put_number(f, mean.value[k]), put_number(f, deviation.value[k]);
            fputc('\n', f);
        }
    }
}

static ts_code replace(const ev_report *r, const char *folder, const char *name, void (*write_to)(const ev_report *, FILE *), ts_status *st)
{
    char path[PATH_LENGTH], part[PATH_LENGTH];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path
        || snprintf(part, sizeof part, "%s/.%s.%ld", folder, name, (long)getpid()) >= (int)sizeof part)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
    FILE *f = fopen(part, "we");
    if (!f) return ts_fail(st, TS_IO, "%s: cannot be written: %s", path, strerror(errno));
    write_to(r, f);
    const bool written = fflush(f) == 0 && !ferror(f) && fsync(fileno(f)) == 0;
    int why = errno;
    const bool closed = fclose(f) == 0;
    if (written && !closed) why = errno;
    if (written && closed && rename(part, path) == 0) return TS_OK;
    if (written && closed) why = errno;
    unlink(part);
    return ts_fail(st, TS_IO, "%s: cannot be written: %s", path, strerror(why));
}

ts_code ev_report_write(const ev_report *r, const char *folder, ts_status *st)
{
    ts_code code = replace(r, folder, "results.csv", write_results, st);
    static const struct {
        const char *name;
        void (*write_to)(const ev_report *, FILE *);
    } others[] = {{"summary.csv", write_summary}, {"results.json", ev_json_write}, {"report.html", ev_html_write}};
    for (size_t i = 0; i < sizeof others / sizeof *others && !code; i++) code = replace(r, folder, others[i].name, others[i].write_to, st);
    return code;
}
