/* results.json. */
#include "data/json.h"
#include "eval/html.h"

static void put_row(FILE *f, const ev_row *row)
{
    for (int k = 0; k < EV_METRICS; k++) {
        fprintf(f, "%s\"%s\": ", k ? ", " : "{", ev_metric_name[k]);
        io_put_json_number(f, row->value[k]);
    }
    fputc('}', f);
}

/* The object's beginning. */
static void put_column(const ev_report *r, int column, FILE *f)
{
    fputs("{\"method\": ", f);
    io_put_json(f, r->method[ev_report_method(r, column)].label);
    fprintf(f, ", \"step\": %d, ", r->step[column]);
}

void ev_json_write(const ev_report *r, FILE *f)
{
    fprintf(f, "{\n\"version\": \"%s\",\n\"model\": ", LGD_VERSION);
    io_put_json(f, r->model);
    fprintf(f,
            ",\n\"size\": %d,\n\"threads\": %d,\n\"pinned\": %s,\n\"repeat\": %d,\n\"isa\": \"%s\",\n\"convolutions\": "
            "\"%s\",\n\"methods\": [",
            r->size, r->threads, r->pinned ? "true" : "false", r->repeat, r->isa, r->exact ? "direct" : "Winograd");
    for (int m = 0; m < r->methods; m++) {
        fputs(m ? ",\n{\"label\": " : "\n{\"label\": ", f);
        io_put_json(f, r->method[m].label);
        fprintf(f, ", \"bytes\": %zu, \"peak_flops\": ", r->method[m].bytes);
        io_put_json_number(f, ev_report_peak(r, -1, m));
        fputc('}', f);
    }
    fputs("],\n\"sets\": [", f);
    for (int s = 0; s < r->sets; s++) {
        fputs(s ? ",\n{\"name\": " : "\n{\"name\": ", f);
        io_put_json(f, r->set_name[s]);
        fputs(", \"steps\": [", f);
        for (int c = 0; c < r->columns; c++) {
            ev_row mean, deviation;
            const int n = ev_report_summary(r, s, c, &mean, &deviation);
            fputs(c ? ",\n  " : "\n  ", f);
            put_column(r, c, f);
            fprintf(f, "\"materials\": %d, \"seconds\": ", n);
            io_put_json_number(f, ev_report_seconds(r, s, c));
            fputs(", \"peak_flops\": ", f);
            io_put_json_number(f, ev_report_peak(r, s, ev_report_method(r, c)));
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
        io_put_json(f, m->material);
        fputs(", \"steps\": [", f);
        for (int c = 0; c < r->columns; c++) {
            fputs(c ? ",\n  " : "\n  ", f);
            put_column(r, c, f);
            fputs("\"seconds\": ", f);
            io_put_json_number(f, m->seconds[c]);
            fputs(", \"error\": ", f);
            put_row(f, &m->row[c]);
            fputc('}', f);
        }
        fputs("]}", f);
    }
    fputs("]\n}\n", f);
}
