#include "eval/figure.h"
#include "cli/plot.h"
#include "eval/text.h"
#include "tensor/cpu.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A figure's lines, and what is written of them. */
typedef struct figure {
    cl_series *series;
    cl_point *point; /* of all series, in order */
    char (*name)[EV_NAME];
    int count, points;
    cl_axes axes;
    const char *x_name;
} figure;

static void write_svg(const void *what, FILE *f)
{
    const figure *g = what;
    cl_plot_write(f, &g->axes, g->series, g->count);
}

static void write_csv(const void *what, FILE *f)
{
    const figure *g = what;
    fprintf(f, "series,point,%s,render_mean,render_deviation\n", g->x_name);
    for (int s = 0; s < g->count; s++)
        for (int i = 0; i < g->series[s].points; i++) {
            const cl_point *p = &g->series[s].point[i];
            ev_csv_field(f, g->series[s].name);
            fputc(',', f);
            ev_csv_field(f, p->label);
            ev_csv_number(f, p->x);
            ev_csv_number(f, p->y);
            ev_csv_number(f, p->deviation);
            fputc('\n', f);
        }
}

static void clear(figure *g)
{
    free(g->series);
    free(g->point);
    free(g->name);
}

/* Room for more series and points; what is there stays. */
static bool grow(figure *g, int series, int points)
{
    cl_series *s = realloc(g->series, (size_t)(g->count + series) * sizeof *s);
    if (s) g->series = s;
    char(*n)[EV_NAME] = realloc(g->name, (size_t)(g->count + series) * sizeof *n);
    if (n) g->name = n;
    cl_point *p = realloc(g->point, (size_t)(g->points + points) * sizeof *p);
    if (p) g->point = p;
    return s && n && p;
}

static void put_point(figure *g, const ev_report *r, int column, double x, const char *label)
{
    ev_row mean, deviation;
    ev_report_summary(r, -1, column, &mean, &deviation);
    cl_point *p = &g->point[g->points++];
    *p = (cl_point){.x = x, .y = mean.value[EV_RENDER], .deviation = deviation.value[EV_RENDER]};
    snprintf(p->label, sizeof p->label, "%s", label);
    g->series[g->count - 1].points++;
}

static void begin_series(figure *g, const char *name)
{
    snprintf(g->name[g->count], EV_NAME, "%s", name);
    g->series[g->count++] = (cl_series){0};
}

static ts_code finish(figure *g, const char *folder, const char *stem, ts_status *st)
{
    char name[64];
    for (int s = 0, at = 0; s < g->count; s++) {
        g->series[s].name = g->name[s];
        g->series[s].point = g->point + at;
        at += g->series[s].points;
    }
    snprintf(name, sizeof name, "%s.svg", stem);
    ts_code code = ev_replace(folder, name, write_svg, g, st);
    snprintf(name, sizeof name, "%s.csv", stem);
    return code ? code : ev_replace(folder, name, write_csv, g, st);
}

static ts_code of_report(const ev_report *r, bool time, const char *folder, ts_status *st)
{
    figure g = {.axes = {time ? "seconds for one photograph" : "refinement steps", "RMSE of the renderings", time},
                .x_name = time ? "seconds" : "step"};
    ts_code code = grow(&g, r->methods, r->columns) ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for a figure");
    for (int m = 0; m < r->methods && !code; m++) {
        begin_series(&g, r->method[m].label);
        for (int i = 0; i < r->method[m].points; i++) {
            const int c = r->method[m].first + i, step = r->step[c];
            char label[16] = "";
            if (time && r->method[m].points > 1 && (i == 0 || i == r->method[m].points - 1 || step % 6 == 0))
                snprintf(label, sizeof label, "%d", step);
            put_point(&g, r, c, time ? ev_report_seconds(r, -1, c) : step, label);
        }
        g.series[m].level = !time && r->method[m].points == 1;
    }
    if (!code) code = finish(&g, folder, time ? "methods" : "iterations", st);
    clear(&g);
    return code;
}

ts_code ev_figure_iterations(const ev_report *r, const char *folder, ts_status *st)
{
    return of_report(r, false, folder, st);
}
ts_code ev_figure_methods(const ev_report *r, const char *folder, ts_status *st)
{
    return of_report(r, true, folder, st);
}

/* A method over its steps. */
static void add_steps(figure *g, const ev_report *r, int m, const char *what)
{
    char name[EV_NAME], label[16];
    snprintf(name, sizeof name, "%d pixels, %s", r->size, what);
    begin_series(g, name);
    for (int i = 0; i < r->method[m].points; i++) {
        const int c = r->method[m].first + i;
        snprintf(label, sizeof label, "%s%d", "T=", r->step[c]);
        put_point(g, r, c, ev_report_seconds(r, -1, c), r->step[c] % 6 == 0 ? label : "");
    }
}

/* A report's first two methods over their steps, the others as one line over their tolerances. */
static bool add_size(figure *g, const ev_report *r, const char *const *tolerance)
{
    char name[EV_NAME];
    if (!grow(g, 3, r->columns)) return false;
    add_steps(g, r, 0, "T = 0 .. 24");
    add_steps(g, r, 1, ts_isa_now() < TS_AVX512BF16 ? "bf16, emulated" : "bf16");
    snprintf(name, sizeof name, "%d pixels, tolerance", r->size);
    begin_series(g, name);
    for (int m = 2; m < r->methods; m++)
        put_point(g, r, r->method[m].first, ev_report_seconds(r, -1, r->method[m].first), tolerance[m - 2]);
    return true;
}

ts_code ev_pareto(ev_run *r, const int *sizes, int count, const char *model, const char *folder, ts_status *st)
{
    static const char *const tolerance[] = {"0.003", "0.006", "0.0125", "0.025", "0.05"};
    enum { TOLERANCES = 5 };
    figure g = {.axes = {"seconds for one photograph", "RMSE of the renderings", true}, .x_name = "seconds"};
    ev_estimator *method = malloc((2 + TOLERANCES) * sizeof *method);
    ts_code code = method ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    if (!code) code = ev_method_parse("lgd:iterations=24", model, -1, &method[0], st);
    if (!code) code = ev_method_parse("lgd:iterations=24,precision=bf16", model, -1, &method[1], st);
    for (int i = 0; i < TOLERANCES && !code; i++) {
        char spec[64];
        snprintf(spec, sizeof spec, "lgd:tolerance=%s", tolerance[i]);
        code = ev_method_parse(spec, model, -1, &method[2 + i], st);
    }
    for (int s = 0; s < count && !code; s++) {
        ev_run at = *r;
        at.size = sizes[s];
        at.method = method;
        at.methods = 2 + TOLERANCES;
        at.perceptual = at.pictures = false;
        at.failures = 0;
        code = ev_run_all(&at, st);
        r->failures += at.failures;
        if (!code && at.report.results == 0)
            code = ts_fail(st, TS_INVALID, "no material could be evaluated at %d pixels", at.size);
        if (!code && !add_size(&g, &at.report, tolerance)) code = ts_fail(st, TS_NOMEM, "out of memory for a figure");
        ev_run_free(&at);
    }
    if (!code) code = finish(&g, folder, "pareto", st);
    clear(&g);
    free(method);
    return code;
}
