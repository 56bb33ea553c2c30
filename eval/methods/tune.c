#include "eval/methods/tune.h"
#include "eval/text.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SPEC = EV_METHOD_TEXT };

bool ev_tune_by_default(const ev_method *m)
{
    bool grid = false;
    for (const ev_setting *s = m->settings; s->key; s++) {
        if (s->type == EV_WEIGHTS && !s->initial) return false;
        grid = grid || s->grid;
    }
    return grid;
}

/* Word number i of words separated by blanks; false: there are fewer. */
static bool word(const char *words, int i, char *out, size_t size)
{
    for (; i > 0 && *words; i--) {
        words += strcspn(words, " ");
        words += strspn(words, " ");
    }
    snprintf(out, size, "%.*s", (int)strcspn(words, " "), words);
    return *out != 0;
}

static void last_word(const char *words, char *out, size_t size)
{
    const char *space = strrchr(words, ' ');
    snprintf(out, size, "%s", space ? space + 1 : words);
}

static ts_code add(ev_tuning *t, const char *spec, int of, const char *model, const char *tried, ts_status *st)
{
    if (t->methods == t->capacity) {
        const int capacity = t->capacity ? 2 * t->capacity : 32;
        ev_estimator *method = malloc((size_t)capacity *
                                      sizeof *method); /* not realloc: settings point into the estimator */
        int *more = realloc(t->of, (size_t)capacity * sizeof *more);
        if (more) t->of = more;
        if (!method || !more) {
            free(method);
            return ts_fail(st, TS_NOMEM, "out of memory for %d combinations", capacity);
        }
        for (int i = 0; i < t->methods; i++) {
            method[i] = t->method[i];
            for (int k = 0; k < EV_SETTINGS; k++) {
                const char *v = t->method[i].value[k], *text = t->method[i].text;
                if (v >= text && v < text + EV_METHOD_TEXT) method[i].value[k] = method[i].text + (v - text);
            }
        }
        free(t->method);
        t->method = method;
        t->capacity = capacity;
    }
    ev_estimator *e = &t->method[t->methods];
    if (ev_method_parse(spec, model, -1, e, st) != TS_OK) return st->code;
    if (ev_ends_early(e))
        return ts_fail(st, TS_INVALID, "--method %s: --tune tries numbers of steps, and tolerance decides them", spec);
    e->tried = tried;
    t->of[t->methods++] = of;
    return TS_OK;
}

/* Whether setting i is the user's. */
static bool is_fixed(const ev_estimator *given, int i)
{
    return given->value[i] && given->value[i] != given->method->settings[i].initial;
}

/* From setting number i on: all of its grid, with each all of the following ones'. */
static ts_code expand(ev_tuning *t, const ev_estimator *given, char *spec, int i, int of, const char *model,
                      const char *tried, ts_status *st)
{
    const ev_setting *s = &given->method->settings[i];
    char value[64];
    const size_t end = strlen(spec);
    const char *comma = strchr(spec, ':') ? "," : ":";
    ts_code code = TS_OK;
    if (!s->key) return add(t, spec, of, model, tried, st);
    if (!s->grid || is_fixed(given, i)) return expand(t, given, spec, i + 1, of, model, tried, st);
    if (s->steps) {
        last_word(s->grid, value, sizeof value);
        snprintf(spec + end, SPEC - end, "%s%s=%s", comma, s->key, value);
        code = expand(t, given, spec, i + 1, of, model, s->grid, st);
    }
    for (int k = 0; !s->steps && !code && word(s->grid, k, value, sizeof value); k++) {
        snprintf(spec + end, SPEC - end, "%s%s=%s", comma, s->key, value);
        code = expand(t, given, spec, i + 1, of, model, tried, st);
    }
    spec[end] = 0;
    return code;
}

/* The given label, or the method's name, then what was given, if all says so, and what differs. Paths are left out.
 * False: it is too long. */
static bool write_label(ev_estimator *e, const ev_estimator *given, bool all)
{
    const size_t size = sizeof e->label;
    int n = snprintf(e->label, size, "%s", given->labelled ? given->label : e->method->name), pairs = 0;
    for (int k = 0; e->method->settings[k].key && n < (int)size; k++) {
        const ev_setting *s = &e->method->settings[k];
        const bool told = all && s->type != EV_WEIGHTS && is_fixed(given, k);
        if (told || (s->grid && !s->steps))
            n += snprintf(e->label + n, size - (size_t)n, "%s%s=%s", pairs++ ? "," : ":", s->key, e->value[k]);
    }
    return n < (int)size;
}

/* The label of combination i: with what was given where there is room for it. */
static ts_code put_label(const ev_tuning *t, int i, const ev_estimator *given, const char *spec, ts_status *st)
{
    ev_estimator *e = &t->method[i];
    const size_t size = sizeof e->label;
    bool fits = write_label(e, given, !given->labelled);
    if (!fits && !given->labelled) fits = write_label(e, given, false);
    if (!fits)
        return ts_fail(st, TS_INVALID,
                       "--method %s: its rows' labels are longer than %zu characters: give a %slabel=", spec, size - 1,
                       given->labelled ? "shorter " : "");
    for (int j = 0; j < i; j++)
        if (!strcmp(e->label, t->method[j].label))
            return ts_fail(st, TS_INVALID,
                           "--method %s: another method's rows are '%s' too: give one of them a label=", spec,
                           e->label);
    return TS_OK;
}

ts_code ev_tune_add(ev_tuning *t, const char *spec, int of, const char *model, ts_status *st)
{
    ev_estimator given;
    char all[SPEC];
    if (ev_method_parse(spec, model, -1, &given, st) != TS_OK) return st->code;
    snprintf(all, sizeof all, "%s", spec);
    const int before = t->methods;
    ts_code code = expand(t, &given, all, 0, of, model, NULL, st);
    for (int i = before; i < t->methods && !code; i++) code = put_label(t, i, &given, spec, st);
    return code;
}

void ev_tune_free(ev_tuning *t)
{
    free(t->method);
    free(t->of);
    *t = (ev_tuning){0};
}

static void write_tune(const void *what, FILE *f)
{
    const ev_report *r = what;
    fputs("method,step,materials,render_mean,render_deviation,seconds\n", f);
    for (int c = 0; c < r->columns; c++) {
        ev_row mean, deviation;
        const int n = ev_report_summary(r, -1, c, &mean, &deviation);
        ev_csv_field(f, r->method[ev_report_method(r, c)].label);
        fprintf(f, ",%d,%d", r->step[c], n);
        ev_csv_number(f, mean.value[EV_RENDER]);
        ev_csv_number(f, deviation.value[EV_RENDER]);
        ev_csv_number(f, ev_report_seconds(r, -1, c));
        fputc('\n', f);
    }
}

ts_code ev_tune_write(const ev_report *r, const char *folder, ts_status *st)
{
    return ev_replace(folder, "tune.csv", write_tune, r, st);
}

static bool complete(const ev_report *r, int column)
{
    for (int i = 0; i < r->results; i++)
        if (isnan(r->result[i].seconds[column])) return false;
    return r->results > 0;
}

void ev_tune_print(const ev_tuning *t, const ev_report *r, FILE *out)
{
    const int specs = t->methods ? t->of[t->methods - 1] + 1 : 0;
    fprintf(out, "%d material%s, %d x %d pixels; RMSE of the renderings\n", r->results, r->results == 1 ? "" : "s",
            r->size, r->size);
    for (int s = 0; s < specs; s++) {
        int best = -1, tried = 0;
        double least = INFINITY;
        const char *name = "";
        for (int c = 0; c < r->columns; c++) {
            const int m = ev_report_method(r, c);
            ev_row mean, deviation;
            if (t->of[m] != s) continue;
            tried++;
            name = t->method[m].method->name;
            ev_report_summary(r, -1, c, &mean, &deviation);
            if (complete(r, c) && mean.value[EV_RENDER] < least) least = mean.value[EV_RENDER], best = c;
        }
        if (best < 0) fprintf(out, "%-12s %4d tried, none of them without a failure\n", name, tried);
        else
            fprintf(out, "%-12s %4d tried, the best: %s, step %d: %.4f in %.3f s\n", name, tried,
                    r->method[ev_report_method(r, best)].label, r->step[best], least, ev_report_seconds(r, -1, best));
    }
}
