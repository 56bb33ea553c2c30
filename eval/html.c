#include "eval/html.h"
#include "eval/plot.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>lgd-eval</title>\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
    "<style>\nbody { font: 14px sans-serif; margin: 2em auto; max-width: 1200px; color: #222; }\n"
    "table { border-collapse: collapse; margin: 1em 0; } td, th { padding: 3px 9px; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }\n"
    "td:first-child, th:first-child { text-align: left; } small { color: #777; } article { border-top: 1px solid #ccc; padding: 0.7em 0; }\n"
    "article h3 { margin: 0 0 0.3em; font-size: 14px; } article img { max-width: 100%; image-rendering: auto; } button { margin: 0 2px; }\n"
    "button[aria-pressed=true] { font-weight: bold; }\n</style>\n";

static const char script[] =
    "<script>\n'use strict';\nlet failed = 0;\naddEventListener('error', () => { failed++; }, true);\n"
    "addEventListener('securitypolicyviolation', () => { failed++; });\n"
    "function sortBy(key, down) {\n"
    "  const list = document.getElementById('materials'), value = a => a.dataset[key] === '' ? -Infinity : Number(a.dataset[key]);\n"
    "  const rows = [...list.children].sort((a, b) => (down ? -1 : 1) * (value(a) - value(b)));\n"
    "  list.append(...rows);\n  document.body.dataset.sorted = key;\n  document.body.dataset.order = down ? 'down' : 'up';\n"
    "  for (const b of document.querySelectorAll('button')) b.setAttribute('aria-pressed', b.dataset.key === key);\n}\n"
    "for (const b of document.querySelectorAll('button'))\n"
    "  b.addEventListener('click', () => sortBy(b.dataset.key, document.body.dataset.sorted !== b.dataset.key || document.body.dataset.order !== 'down'));\n"
    "addEventListener('load', () => {\n"
    "  for (const i of document.images) if (!i.complete || !i.naturalWidth) failed++;\n"
    "  const b = location.hash && document.querySelector('button[data-key=\"' + location.hash.slice(1) + '\"]');\n  if (b) b.click();\n"
    "  document.body.dataset.failed = failed;\n});\n</script>\n";

static void number(FILE *f, double v, int digits)
{
    if (isnan(v)) fputs("&#8211;", f);
    else fprintf(f, "%.*f", digits, v);
}

static int digits_of(int metric) { return metric == EV_ANGLE || metric == EV_EXPOSURE ? 2 : 4; }

static void table(const ev_report *r, int set, FILE *f)
{
    ev_row mean, deviation, any;
    const int n = ev_report_summary(r, set, 0, &any, &deviation);
    if (n == 0) return;
    fputs("<h2>", f);
    ev_put_text(f, set < 0 ? "all sets" : r->set_name[set]);
    fprintf(f, "</h2>\n<table><tr><th>%d material%s</th><th>seconds</th>", n, n == 1 ? "" : "s");
    for (int k = 0; k < EV_METRICS; k++)
        if (!isnan(any.value[k])) fprintf(f, "<th>%s</th>", ev_metric_name[k]);
    fputs("</tr>\n", f);
    for (int t = 0; t <= r->steps; t++) {
        ev_report_summary(r, set, t, &mean, &deviation);
        fprintf(f, "<tr><td>R<sub>%d</sub></td><td>%.3f</td>", t, ev_report_seconds(r, set, t));
        for (int k = 0; k < EV_METRICS; k++) {
            if (isnan(any.value[k])) continue;
            fputs("<td>", f);
            number(f, mean.value[k], digits_of(k));
            if (!isnan(mean.value[k])) fprintf(f, " <small>&#177; %.*f</small>", digits_of(k), deviation.value[k]);
            fputs("</td>", f);
        }
        fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

static void plot(const ev_report *r, FILE *f)
{
    const size_t points = (size_t)r->steps + 1, sets = r->sets > 0 ? (size_t)r->sets : 0;
    ev_point *point = calloc(points * sets, sizeof *point);
    ev_series *series = calloc(sets, sizeof *series);
    for (int s = 0; s < r->sets && point && series; s++) {
        ev_point *p = point + (size_t)s * points;
        series[s] = (ev_series){r->set_name[s], p, (int)points};
        for (int t = 0; t <= r->steps; t++) {
            ev_row mean, deviation;
            p[t].x = ev_report_summary(r, s, t, &mean, &deviation) ? ev_report_seconds(r, s, t) : NAN;
            p[t].y = mean.value[EV_RENDER];
            p[t].deviation = deviation.value[EV_RENDER];
            if (t == 0 || t == r->steps || t % 6 == 0) snprintf(p[t].label, sizeof p[t].label, "T=%d", t);
        }
    }
    fputs("<h2>Time against error</h2>\n", f);
    ev_plot_write(f, "seconds for one photograph", "RMSE of the renderings", series, point && series ? r->sets : 0);
    free(point);
    free(series);
}

/* RFC 4648. */
static void base64(FILE *f, const unsigned char *bytes, size_t size)
{
    static const char letter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const unsigned v = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) | (left > 2 ? bytes[i + 2] : 0);
        const char four[4] = {letter[v >> 18], letter[v >> 12 & 63], left > 1 ? letter[v >> 6 & 63] : '=', left > 2 ? letter[v & 63] : '='};
        fwrite(four, 1, 4, f);
    }
}

static bool measured(const ev_report *r, int metric)
{
    for (int i = 0; i < r->results; i++)
        if (!isnan(r->result[i].row[r->steps].value[metric])) return true;
    return false;
}

static void material(const ev_report *r, const ev_result *m, FILE *f)
{
    const ev_row *first = &m->row[0], *last = &m->row[r->steps];
    fputs("<article", f);
    for (int k = 0; k < EV_METRICS; k++) {
        if (isnan(last->value[k])) fprintf(f, " data-%s=\"\"", ev_metric_name[k]);
        else fprintf(f, " data-%s=\"%.6f\"", ev_metric_name[k], last->value[k]);
    }
    fputs("><h3>", f);
    ev_put_text(f, m->material);
    fputs(" <small>", f);
    ev_put_text(f, r->set_name[m->set]);
    fputs("</small></h3>\n<table><tr><th></th>", f);
    for (int k = 0; k < EV_METRICS; k++)
        if (!isnan(last->value[k])) fprintf(f, "<th>%s</th>", ev_metric_name[k]);
    for (int i = 0; i < (r->steps ? 2 : 1); i++) {
        fprintf(f, "</tr>\n<tr><td>R<sub>%d</sub></td>", i ? r->steps : 0);
        for (int k = 0; k < EV_METRICS; k++) {
            if (isnan(last->value[k])) continue;
            fputs("<td>", f);
            number(f, (i ? last : first)->value[k], digits_of(k));
            fputs("</td>", f);
        }
    }
    fputs("</tr></table>\n", f);
    if (m->png) {
        fputs("<img alt=\"\" src=\"data:image/png;base64,", f);
        base64(f, m->png, m->png_size);
        fputs("\">\n", f);
    }
    fputs("</article>\n", f);
}

void ev_html_write(const ev_report *r, FILE *f)
{
    fputs(head, f);
    fprintf(f, "</head><body>\n<h1>lgd-eval</h1>\n<p>%d &#215; %d pixels, %d thread%s, %s; model ", r->size, r->size, r->threads, r->threads == 1 ? "" : "s", r->isa);
    ev_put_text(f, r->model);
    fputs(". Mean and standard deviation over the materials; seconds: median. diffuse to render: RMSE; angle: degrees; ssim, flip, exposure, lpips: themselves.</p>\n", f);
    for (int s = 0; s < r->sets; s++) table(r, s, f);
    if (r->sets > 1) table(r, -1, f);
    plot(r, f);
    fputs("<h2>Materials</h2>\n<p>Sort by:", f);
    for (int k = 0; k < EV_METRICS; k++)
        if (measured(r, k)) fprintf(f, " <button data-key=\"%s\">%s</button>", ev_metric_name[k], ev_metric_name[k]);
    fprintf(f,
        "</p>\n<p>Rows: the truth; R<sub>%d</sub>; four times their difference. Columns: input and its re-rendering, diffuse, specular, roughness, normal, renderings"
        " under other lights and cameras (of a capture: its photographs and their re-renderings).</p>\n<div id=\"materials\">\n",
        r->steps);
    for (int i = 0; i < r->results; i++) material(r, &r->result[i], f);
    fputs("</div>\n", f);
    fputs(script, f);
    fputs("</body></html>\n", f);
}
