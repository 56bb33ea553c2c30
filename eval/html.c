#include "eval/html.h"
#include "cli/plot.h"
#include "eval/text.h"
#include "tensor/conv/conv.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>lgd-eval</title>\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
    "'unsafe-inline'; script-src 'unsafe-inline'\">\n"
    "<style>\nbody { font: 14px sans-serif; margin: 2em auto; max-width: 1200px; color: #222; }\n"
    "table { border-collapse: collapse; margin: 1em 0; } td, th { padding: 3px 9px; text-align: right; border-bottom: "
    "1px solid #ddd; white-space: nowrap; }\n"
    "td:first-child, th:first-child { text-align: left; } small { color: #777; } article { border-top: 1px solid #ccc; "
    "padding: 0.7em 0; }\n"
    "article h3 { margin: 0 0 0.3em; font-size: 14px; } article img { max-width: 100%; image-rendering: auto; } button "
    "{ margin: 0 2px; } figure { margin: 0.4em 0; }\n"
    "button[aria-pressed=true] { font-weight: bold; }\n</style>\n";

static const char script[] =
    "<script>\n'use strict';\nlet failed = 0;\naddEventListener('error', () => { failed++; }, true);\n"
    "addEventListener('securitypolicyviolation', () => { failed++; });\n"
    "function sortBy(key, down) {\n"
    "  const list = document.getElementById('materials'), which = document.getElementById('method'), at = which ? "
    "which.value : 0;\n"
    "  const value = a => { const v = a.getAttribute('data-' + key + (at > 0 ? '-' + at : '')); return v ? Number(v) : "
    "-Infinity; };\n"
    "  const rows = [...list.children].sort((a, b) => (down ? -1 : 1) * (value(a) - value(b)));\n"
    "  list.append(...rows);\n  document.body.dataset.sorted = key;\n  document.body.dataset.order = down ? 'down' : "
    "'up';\n"
    "  for (const b of document.querySelectorAll('button')) b.setAttribute('aria-pressed', b.dataset.key === key);\n}\n"
    "for (const b of document.querySelectorAll('button'))\n"
    "  b.addEventListener('click', () => sortBy(b.dataset.key, document.body.dataset.sorted !== b.dataset.key || "
    "document.body.dataset.order !== 'down'));\n"
    "const which = document.getElementById('method');\nif (which) which.addEventListener('change', () => "
    "sortBy(document.body.dataset.sorted || 'render', document.body.dataset.order !== 'up'));\n"
    "addEventListener('load', () => {\n"
    "  for (const i of document.images) if (!i.complete || !i.naturalWidth) failed++;\n"
    "  const b = location.hash && document.querySelector('button[data-key=\"' + location.hash.slice(1) + '\"]');\n  if "
    "(b) b.click();\n"
    "  document.body.dataset.failed = failed;\n});\n</script>\n";

static void number(FILE *f, double v, int digits)
{
    if (isnan(v)) fputs("&#8211;", f);
    else fprintf(f, "%.*f", digits, v);
}

static int digits_of(int metric) { return metric == EV_ANGLE || metric == EV_EXPOSURE ? 2 : 4; }

static void put_name(const ev_report *r, int column, FILE *f)
{
    char name[EV_NAME];
    if (r->methods == 1) fprintf(f, "R<sub>%d</sub>", r->step[column]);
    else cl_put_text(f, ev_report_name(r, column, name));
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
    const int n = ev_report_summary(r, set, 0, &mean, &deviation);
    bool has[EV_METRICS];
    if (n == 0) return;
    fputs("<h2>", f);
    cl_put_text(f, set < 0 ? "all sets" : r->set_name[set]);
    fprintf(f, "</h2>\n<table><tr><th>%d material%s</th><th>seconds</th><th>GFLOP/s peak</th><th>MB</th>", n,
            n == 1 ? "" : "s");
    for (int k = 0; k < EV_METRICS; k++)
        if ((has[k] = measured(r, s, set, k))) fprintf(f, "<th>%s</th>", ev_metric_name[k]);
    fputs("</tr>\n", f);
    for (int i = 0; i < s->columns; i++) {
        const int c = s->column[i], m = ev_report_method(r, c);
        ev_report_summary(r, set, c, &mean, &deviation);
        fputs("<tr><td>", f);
        put_name(r, c, f);
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
    fputs("</table>\n", f);
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
    fputs("<h2>Time against error</h2>\n", f);
    cl_plot_write(f, &(cl_axes){"seconds for one photograph", "RMSE of the renderings", true}, series,
                  point && series ? lines : 0);
    free(point);
    free(series);
}

/* RFC 4648. */
static void base64(FILE *f, const unsigned char *bytes, size_t size)
{
    static const char letter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const unsigned v = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
            (left > 2 ? bytes[i + 2] : 0);
        const char four[4] = {letter[v >> 18], letter[v >> 12 & 63], left > 1 ? letter[v >> 6 & 63] : '=',
                              left > 2 ? letter[v & 63] : '='};
        fwrite(four, 1, 4, f);
    }
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
    cl_put_text(f, m->material);
    fputs(" <small>", f);
    cl_put_text(f, r->set_name[m->set]);
    fputs("</small></h3>\n<table><tr><th></th>", f);
    for (int i = 0; i < columns; i++) {
        fputs("<th>", f);
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
    fputs("</table>\n", f);
    for (int i = 0; i < r->methods; i++) {
        if (!m->png[i]) continue;
        fputs("<figure>", f);
        if (r->methods > 1) {
            fputs("<figcaption>", f);
            cl_put_text(f, r->method[i].label);
            fputs("</figcaption>", f);
        }
        fputs("<img alt=\"\" src=\"data:image/png;base64,", f);
        base64(f, m->png[i], m->png_size[i]);
        fputs("\"></figure>\n", f);
    }
    fputs("</article>\n", f);
}

/* Whose errors the buttons sort by. */
static void choice(const ev_report *r, FILE *f)
{
    if (r->methods == 1) return;
    fputs(" <select id=\"method\">", f);
    for (int i = 0; i < r->methods; i++) {
        fprintf(f, "<option value=\"%d\">", i);
        cl_put_text(f, r->method[i].label);
        fputs("</option>", f);
    }
    fputs("</select>", f);
}

void ev_html_write(const ev_report *r, FILE *f)
{
    shown s = {.column = malloc((size_t)r->columns * sizeof *s.column)};
    s.columns = s.column ? ev_report_shown(r, s.column) : 0;
    fputs(head, f);
    fprintf(f, "</head><body>\n<h1>lgd-eval</h1>\n<p>%d &#215; %d pixels, %d thread%s%s, %s, %s convolutions; model ",
            r->size, r->size, r->threads, r->threads == 1 ? "" : "s", r->pinned ? ", pinned" : "", r->isa,
            r->exact ? "direct" : "Winograd");
    cl_put_text(f, r->model);
    fprintf(f,
            ". Mean and standard deviation over the materials; seconds: median over them, of %d run%s each; peak: "
            "multiply-adds in registers, measured beside the method; MB: its weights, moments"
            " and activations. diffuse to render: RMSE; angle: degrees; ssim, flip, exposure, lpips: themselves.</p>\n",
            r->repeat, r->repeat == 1 ? "" : "s");
    for (int i = 0; i < r->sets; i++) table(r, &s, i, f);
    if (r->sets > 1) table(r, &s, -1, f);
    plot(r, f);
    fputs("<h2>Materials</h2>\n<p>Sort by:", f);
    choice(r, f);
    for (int k = 0; k < EV_METRICS; k++)
        if (measured(r, &s, -1, k))
            fprintf(f, " <button data-key=\"%s\">%s</button>", ev_metric_name[k], ev_metric_name[k]);
    fputs("</p>\n<p>Pictures: the truth; the estimate; four times their difference. Columns: input and its "
          "re-rendering, diffuse, specular, roughness, normal, renderings"
          " under other lights and cameras (of a capture: its photographs and their re-renderings). Of a photograph "
          "without known maps: itself, diffuse, specular, roughness, normal, and its re-rendering as bright as it is; "
          "below, a peer's maps where there are any.</p>\n<div "
          "id=\"materials\">\n",
          f);
    for (int i = 0; i < r->results; i++) material(r, &s, &r->result[i], f);
    fputs("</div>\n", f);
    fputs(script, f);
    fputs("</body></html>\n", f);
    free(s.column);
}
