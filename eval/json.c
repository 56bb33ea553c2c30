/* results.json. */
#include "eval/html.h"
#include <math.h>

static void put_string(FILE *f, const char *text)
{
    fputc('"', f);
    for (; *text; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') fprintf(f, "\\%c", c);
        else if (c < 0x20) fprintf(f, "\\u%04x", c);
        else fputc(c, f);
    }
    fputc('"', f);
}

static void put_number(FILE *f, double v)
{
    if (isfinite(v)) fprintf(f, "%.9g", v);
    else fputs("null", f);
}

static void put_row(FILE *f, const ev_row *row)
{
    for (int k = 0; k < EV_METRICS; k++) {
        fprintf(f, "%s\"%s\": ", k ? ", " : "{", ev_metric_name[k]);
        put_number(f, row->value[k]);
    }
    fputc('}', f);
}

void ev_json_write(const ev_report *r, FILE *f)
{
    fprintf(f, "{\n\"version\": \"%s\",\n\"model\": ", LGD_VERSION);
    put_string(f, r->model);
    fprintf(f, ",\n\"size\": %d,\n\"threads\": %d,\n\"isa\": \"%s\",\n\"sets\": [", r->size, r->threads, r->isa);
    for (int s = 0; s < r->sets; s++) {
        fputs(s ? ",\n{\"name\": " : "\n{\"name\": ", f);
        put_string(f, r->set_name[s]);
        fputs(", \"steps\": [", f);
        for (int t = 0; t <= r->steps; t++) {
            ev_row mean, deviation;
            const int n = ev_report_summary(r, s, t, &mean, &deviation);
            fprintf(f, "%s\n  {\"step\": %d, \"materials\": %d, \"seconds\": ", t ? "," : "", t, n);
            put_number(f, ev_report_seconds(r, s, t));
            fputs(", \"mean\": ", f);
            put_row(f, &mean);
            fputs(", \"deviation\": ", f);
            put_row(f, &deviation);
            fputc('}', f);
        }
        fputs("]}", f);
    }
    fputs("],\n\"materials\": [", f);
    for (int i = 0; i < r->results; i++) {
        const ev_result *m = &r->result[i];
        fprintf(f, "%s\n{\"set\": %d, \"name\": ", i ? "," : "", m->set);
        put_string(f, m->material);
        fputs(", \"steps\": [", f);
        for (int t = 0; t <= r->steps; t++) {
            fprintf(f, "%s\n  {\"step\": %d, \"seconds\": ", t ? "," : "", t);
            put_number(f, m->seconds[t]);
            fputs(", \"error\": ", f);
            put_row(f, &m->row[t]);
            fputc('}', f);
        }
        fputs("]}", f);
    }
    fputs("]\n}\n", f);
}
