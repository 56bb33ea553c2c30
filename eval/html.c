#include "eval/html.h"
#include "cli/plot.h"
#include "data/html.h"
#include "eval/text.h"
#include "pages.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void number(FILE *f, double v, int digits)
{
    if (isnan(v)) fputs("&#8211;", f);
    else fprintf(f, "%.*f", digits, v);
}

/* What a metric is measured in, and whether less or more of it is better. */
static const char *unit(int metric)
{
    if (metric <= EV_RENDER) return "RMSE &#8595;";
    if (metric == EV_ANGLE) return "degrees &#8595;";
    if (metric == EV_SSIM || (metric >= EV_BAND && metric < EV_BAND + EV_BANDS)) return "&#8593;";
    return metric == EV_FLIP || metric == EV_LPIPS || metric == EV_OVER_FLAT ? "&#8595;" : "&nbsp;";
}

static int digits_of(int metric) { return metric == EV_ANGLE || metric == EV_EXPOSURE ? 2 : 4; }

static void put_name(const ev_report *r, int column, FILE *f)
{
    char name[EV_NAME];
    if (r->methods == 1) fprintf(f, "R<sub>%d</sub>", r->step[column]);
    else io_put_text(f, ev_report_name(r, column, name));
}

/* The columns that tables show, and whether any of them has a metric in the set. */
typedef struct shown {
    int *column, columns;
} shown;

static bool measured(const ev_report *r, const shown *s, int set, int metric)
{
    ev_row mean, deviation;
    for (int i = 0; i < s->columns; i++) {
        ev_report_summary(r, set, s->column[i], &mean, &deviation);
        if (!isnan(mean.value[metric])) return true;
    }
    return false;
}

static void table(const ev_report *r, const shown *s, int set, FILE *f)
{
    ev_row mean, deviation;
    const int all = ev_report_materials(r, set);
    bool has[EV_METRICS];
    if (all == 0) return;
    fputs("<h2>", f);
    io_put_text(f, set < 0 ? "all sets" : r->set_name[set]);
    fprintf(f,
            "</h2>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Means\"><table><tr><th>%d "
            "material%s</th><th>time<br><small>seconds</small></th><th>peak<br><small>GFLOP/s</small></th>"
            "<th>memory<br><small>MB</small></th>",
            all, all == 1 ? "" : "s");
    for (int k = 0; k < EV_METRICS; k++)
        if ((has[k] = measured(r, s, set, k)))
            fprintf(f, "<th scope=\"col\">%s<br><small>%s</small></th>", ev_metric_name[k], unit(k));
    fputs("</tr>\n", f);
    for (int i = 0; i < s->columns; i++) {
        const int c = s->column[i], m = ev_report_method(r, c), n = ev_report_summary(r, set, c, &mean, &deviation);
        fputs("<tr><td>", f);
        put_name(r, c, f);
        if (n != all) fprintf(f, " <small>%d of %d</small>", n, all);
        fputs("</td><td>", f);
        number(f, ev_report_seconds(r, set, c), 3);
        fputs("</td><td>", f);
        number(f, 1e-9 * ev_report_peak(r, set, m), 0);
        fprintf(f, "</td><td>%.0f</td>", 1e-6 * (double)r->method[m].bytes);
        for (int k = 0; k < EV_METRICS; k++) {
            if (!has[k]) continue;
            fputs("<td>", f);
            number(f, mean.value[k], digits_of(k));
            if (!isnan(mean.value[k])) fprintf(f, " <small>&#177; %.*f</small>", digits_of(k), deviation.value[k]);
            fputs("</td>", f);
        }
        fputs("</tr>\n", f);
    }
    fputs("</table></div>\n", f);
}

/* With one method a line for each set, with several a line for each method over all sets. */
static void plot(const ev_report *r, FILE *f)
{
    const int lines = r->methods > 1 ? r->methods : r->sets;
    cl_point *point = calloc((size_t)lines * (size_t)r->columns, sizeof *point);
    cl_series *series = calloc((size_t)lines, sizeof *series);
    for (int s = 0; s < lines && point && series; s++) {
        const ev_subject *m = &r->method[r->methods > 1 ? s : 0];
        const int set = r->methods > 1 ? -1 : s;
        cl_point *p = point + (size_t)s * (size_t)r->columns;
        series[s] = (cl_series){r->methods > 1 ? m->label : r->set_name[s], p, m->points, false};
        for (int t = 0; t < m->points; t++) {
            ev_row mean, deviation;
            const int step = r->step[m->first + t];
            p[t].x = ev_report_summary(r, set, m->first + t, &mean, &deviation)
                ? ev_report_seconds(r, set, m->first + t)
                : NAN;
            p[t].y = mean.value[EV_RENDER];
            p[t].deviation = deviation.value[EV_RENDER];
            if (m->points > 1 && (t == 0 || t == m->points - 1 || step % 6 == 0))
                snprintf(p[t].label, sizeof p[t].label, "%s%d", r->methods > 1 ? "" : "T=", step);
        }
    }
    cl_plot_write(f, &(cl_axes){"seconds for one photograph", "RMSE of the renderings", true}, series,
                  point && series ? lines : 0);
    free(point);
    free(series);
}

/* The errors to sort by: those of each method's last maps. */
static void sort_keys(const ev_report *r, const ev_result *m, FILE *f)
{
    for (int i = 0; i < r->methods; i++) {
        const ev_row *last = &m->row[r->method[i].first + r->method[i].points - 1];
        for (int k = 0; k < EV_METRICS; k++) {
            fprintf(f, " data-%s", ev_metric_name[k]);
            if (i > 0) fprintf(f, "-%d", i);
            if (isnan(last->value[k])) fputs("=\"\"", f);
            else fprintf(f, "=\"%.6f\"", last->value[k]);
        }
    }
}

/* A picture with the names of its rows and columns. */
static void sheet(const ev_result *m, int method, FILE *f)
{
    const ev_sheet_shape *shape = &m->sheet;
    const int panel = shape->kind == EV_SHEET_ALONE ? EV_SHEET_PHOTO : EV_SHEET_PANEL, beside = 84; /* report.css */
    char label[EV_SHEET_LABEL];
    fprintf(f, "<div class=\"sheet\" style=\"min-width: %dpx; max-width: %dpx\"><div class=\"columns\">",
            beside + 72 * shape->columns, beside + panel * shape->columns);
    for (int i = 0; i < shape->columns; i++) fprintf(f, "<span>%s</span>", ev_sheet_column(shape, i, label));
    fputs("</div><div class=\"rows\">", f);
    for (int i = 0; i < shape->rows; i++) fprintf(f, "<span>%s</span>", ev_sheet_row(shape, i));
    fputs("</div><img alt=\"", f);
    io_put_text(f, m->material);
    fputs(": pictures in the rows and columns that are named beside\" src=\"data:image/png;base64,", f);
    io_put_base64(f, m->png[method], m->png_size[method]);
    fputs("\"></div>", f);
}

static void material(const ev_report *r, const shown *s, const ev_result *m, FILE *f)
{
    const int ends[2] = {0, r->columns - 1}; /* of a lone method the first and the last */
    const int *column = r->methods > 1 ? s->column : ends,
              columns = r->methods > 1 ? s->columns
        : r->columns > 1               ? 2
                                       : 1;
    fputs("<article", f);
    sort_keys(r, m, f);
    fputs("><h3>", f);
    io_put_text(f, m->material);
    fputs(" <small>", f);
    io_put_text(f, r->set_name[m->set]);
    fputs("</small></h3>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" "
          "aria-label=\"Errors of ",
          f);
    io_put_text(f, m->material);
    fputs("\"><table><tr><th></th>", f);
    for (int i = 0; i < columns; i++) {
        fputs("<th scope=\"col\">", f);
        put_name(r, column[i], f);
        fputs("</th>", f);
    }
    fputs("</tr>\n", f);
    for (int k = 0; k < EV_METRICS; k++) {
        bool any = false;
        for (int i = 0; i < columns; i++) any = any || !isnan(m->row[column[i]].value[k]);
        if (!any) continue;
        fprintf(f, "<tr><td>%s</td>", ev_metric_name[k]);
        for (int i = 0; i < columns; i++) {
            fputs("<td>", f);
            number(f, m->row[column[i]].value[k], digits_of(k));
            fputs("</td>", f);
        }
        fputs("</tr>\n", f);
    }
    fputs("</table></div>\n", f);
    for (int i = 0; i < r->methods; i++) {
        if (!m->png[i]) continue;
        fputs("<figure><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Pictures of ", f);
        io_put_text(f, m->material);
        fputs("\">", f);
        if (r->methods > 1) {
            fputs("<figcaption>", f);
            io_put_text(f, r->method[i].label);
            fputs("</figcaption>", f);
        }
        sheet(m, i, f);
        fputs("</div></figure>\n", f);
    }
    fputs("</article>\n", f);
}

/* Whose errors the buttons sort by. */
static void choice(const ev_report *r, FILE *f)
{
    if (r->methods == 1) return;
    fputs("<select id=\"method\" aria-label=\"Method\">", f);
    for (int i = 0; i < r->methods; i++) {
        fprintf(f, "<option value=\"%d\">", i);
        io_put_text(f, r->method[i].label);
        fputs("</option>", f);
    }
    fputs("</select>", f);
}

typedef struct page {
    const ev_report *report;
    shown shown;
} page;

static void put_about(FILE *f, void *user)
{
    const ev_report *r = ((const page *)user)->report;
    fprintf(f, "%d &#215; %d pixels, %d thread%s%s, %s, %s convolutions; model ", r->size, r->size, r->threads,
            r->threads == 1 ? "" : "s", r->pinned ? ", pinned" : "", r->isa, r->exact ? "direct" : "Winograd");
    io_put_text(f, r->model);
    fprintf(f,
            ". Mean and standard deviation over the materials. Time: median over them, of %d run%s each. Peak: "
            "multiply-adds in registers, measured beside the method. Memory: weights, moments and activations. &#8595; "
            "less is better, &#8593; more is.",
            r->repeat, r->repeat == 1 ? "" : "s");
}

static void put_tables(FILE *f, void *user)
{
    const page *p = user;
    for (int i = 0; i < p->report->sets; i++) table(p->report, &p->shown, i, f);
    if (p->report->sets > 1) table(p->report, &p->shown, -1, f);
}

static void put_plot(FILE *f, void *user) { plot(((const page *)user)->report, f); }

static void put_keys(FILE *f, void *user)
{
    const page *p = user;
    choice(p->report, f);
    for (int k = 0; k < EV_METRICS; k++)
        if (measured(p->report, &p->shown, -1, k))
            fprintf(f, " <button type=\"button\" data-key=\"%s\">%s</button>", ev_metric_name[k], ev_metric_name[k]);
}

static void put_materials(FILE *f, void *user)
{
    const page *p = user;
    for (int i = 0; i < p->report->results; i++) material(p->report, &p->shown, &p->report->result[i], f);
}

void ev_html_write(const ev_report *r, FILE *f)
{
    static const io_slot slots[] = {{"style", page_report_css, NULL},   {"script", page_report_js, NULL},
                                    {"about", NULL, put_about},         {"tables", NULL, put_tables},
                                    {"plot", NULL, put_plot},           {"keys", NULL, put_keys},
                                    {"materials", NULL, put_materials}, {NULL, NULL, NULL}};
    page p = {r, {.column = malloc((size_t)r->columns * sizeof *p.shown.column)}};
    p.shown.columns = p.shown.column ? ev_report_shown(r, p.shown.column) : 0;
    io_put_page(f, page_report_html, slots, &p);
    free(p.shown.column);
}
