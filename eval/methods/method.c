#include "cli/cli.h"
#include "eval/methods/method_internal.h"
#include <stdlib.h>
#include <string.h>

extern const ev_method ev_method_mean, ev_method_unet, ev_method_unet_joint, ev_method_lgd, ev_method_lgd_nograd,
    ev_method_frozen, ev_method_descent, ev_method_newton, ev_method_finetune, ev_method_latent, ev_method_peer;
const ev_method *const ev_methods[] = {&ev_method_mean,    &ev_method_unet,       &ev_method_unet_joint,
                                       &ev_method_lgd,     &ev_method_lgd_nograd, &ev_method_frozen,
                                       &ev_method_descent, &ev_method_newton,     &ev_method_finetune,
                                       &ev_method_latent,  &ev_method_peer,       NULL};

static ts_code check(const char *spec, const ev_setting *s, const char *value, ts_status *st)
{
    int64_t whole;
    double real;
    switch (s->type) {
    case EV_WHOLE:
        if (cl_parse_int(value, (int64_t)s->lo, (int64_t)s->hi, &whole)) return TS_OK;
        return ts_fail(st, TS_INVALID, "--method %s: %s is a whole number in %.0f .. %.0f, not '%s'", spec, s->key,
                       s->lo, s->hi, value);
    case EV_REAL:
        if (cl_parse_real(value, s->lo, s->hi, &real)) return TS_OK;
        return ts_fail(st, TS_INVALID, "--method %s: %s is a number in %g .. %g, not '%s'", spec, s->key, s->lo, s->hi,
                       value);
    case EV_WORD:
        if (ev_word(s->words, value) >= 0) return TS_OK;
        return ts_fail(st, TS_INVALID, "--method %s: %s is one of: %s; not '%s'", spec, s->key, s->words, value);
    case EV_WEIGHTS: break;
    }
    return *value ? TS_OK : ts_fail(st, TS_INVALID, "--method %s: %s names no file", spec, s->key);
}

static ts_code unknown(const char *spec, const ev_method *m, const char *what, ts_status *st)
{
    char names[400] = "";
    for (int i = 0; m ? m->settings[i].key != NULL : ev_methods[i] != NULL; i++) {
        const size_t n = strlen(names);
        snprintf(names + n, sizeof names - n, "%s%s", i ? ", " : "", m ? m->settings[i].key : ev_methods[i]->name);
    }
    if (m)
        return ts_fail(st, TS_INVALID, "--method %s: there is no setting '%s'; %s has: %s%slabel", spec, what, m->name,
                       names, *names ? ", " : "");
    return ts_fail(st, TS_INVALID, "--method %s: there is no method '%s'; there are: %s", spec, what, names);
}

ts_code ev_method_parse(const char *spec, const char *model, int iterations, ev_estimator *e, ts_status *st)
{
    memset(e, 0, sizeof *e);
    e->exact = true;
    e->weights = model;
    if (strlen(spec) + 16 >= sizeof e->text) return ts_fail(st, TS_INVALID, "--method %.60s...: is too long", spec);
    strcpy(e->text, spec);
    char *rest = strchr(e->text, ':');
    if (rest) *rest++ = 0;
    for (int i = 0; ev_methods[i] && !e->method; i++)
        if (!strcmp(ev_methods[i]->name, e->text)) e->method = ev_methods[i];
    if (!e->method) return unknown(spec, NULL, e->text, st);
    snprintf(e->label, sizeof e->label, "%s",
             strlen(spec) < sizeof e->label && !strchr(spec, '/') ? spec : e->method->name); /* a path says little */
    for (char *pair = rest; pair && *pair; pair = rest) {
        rest = strchr(pair, ',');
        if (rest) *rest++ = 0;
        char *equals = strchr(pair, '=');
        if (!equals) return ts_fail(st, TS_INVALID, "--method %s: '%s' is not key=value", spec, pair);
        *equals++ = 0;
        if (!strcmp(pair, "label")) {
            if (!*equals || strlen(equals) >= sizeof e->label || strchr(equals, '/'))
                return ts_fail(st, TS_INVALID, "--method %s: label has 1 to %zu characters and no '/'", spec,
                               sizeof e->label - 1);
            strcpy(e->label, equals);
            e->labelled = true;
            continue;
        }
        const int i = ev_find(e->method->settings, pair);
        if (i < 0) return unknown(spec, e->method, pair, st);
        if (e->value[i]) return ts_fail(st, TS_INVALID, "--method %s: %s is given twice", spec, pair);
        if (check(spec, &e->method->settings[i], equals, st) != TS_OK) return st->code;
        e->value[i] = equals;
    }
    for (int i = 0; e->method->settings[i].key; i++) {
        const ev_setting *s = &e->method->settings[i];
        if (e->value[i]) continue;
        e->value[i] = s->initial;
        if (s->type == EV_WEIGHTS && s->initial) e->value[i] = model;
        else if (s->type == EV_WEIGHTS)
            return ts_fail(st, TS_INVALID, "--method %s: needs weights: %s:%s=FILE (%s)", spec, e->method->name, s->key,
                           s->help);
        if (!strcmp(s->key, "iterations") && iterations >= 0) {
            char *at = e->text + sizeof e->text - 12; /* behind the text, which is shorter */
            snprintf(at, 12, "%d", iterations);
            e->value[i] = at;
        }
    }
    return TS_OK;
}

void ev_method_help(FILE *f)
{
    for (int i = 0; ev_methods[i]; i++) {
        fprintf(f, "  %-12s %s\n", ev_methods[i]->name, ev_methods[i]->help);
        for (const ev_setting *s = ev_methods[i]->settings; s->key; s++) {
            fprintf(f, "    %-10s ", s->key);
            if (s->type == EV_WEIGHTS) fputs("FILE; ", f);
            else if (s->type == EV_WORD) fprintf(f, "%s; ", s->words);
            else fprintf(f, "%g .. %g; ", s->lo, s->hi);
            fputs(s->help, f);
            if (s->initial && *s->initial) fprintf(f, " (default %s)", s->initial);
            fputc('\n', f);
        }
    }
}

ts_code ev_open(ev_estimator *e, ts_status *st)
{
    ts_code code = e->method->open ? e->method->open(e, st) : TS_OK;
    if (code && !strstr(st->message, e->method->name)) ts_context(st, "%s", e->label);
    if (code) ev_close(e);
    return code;
}

void ev_close(ev_estimator *e)
{
    nn_model_free(&e->net);
    nn_model_free(&e->coder);
    ag_tape_destroy(&e->tape);
    ag_tape_destroy(&e->train);
    nn_adam_free(&e->adam);
    free(e->kept);
    free(e->x);
    free(e->gradient);
    e->kept = e->x = e->gradient = NULL;
    e->bytes = e->count = 0;
}

bool ev_ends_early(const ev_estimator *e)
{
    return ev_find(e->method->settings, "tolerance") >= 0 && ev_number(e, "tolerance") > 0;
}

int ev_asked_photos(const ev_estimator *e)
{
    return ev_find(e->method->settings, "photos") >= 0 && ev_given(e, "photos") ? ev_photos(e) : 0;
}

bool ev_has_iterations(const ev_estimator *e) { return ev_find(e->method->settings, "iterations") >= 0; }

int ev_points(const ev_estimator *e, int step[EV_POINTS])
{
    const int steps = e->method->steps ? e->method->steps(e) : 0;
    int n = 0;
    if (e->last_alone) step[n++] = steps;
    else if (e->tried)
        for (const char *p = e->tried; *p && n < EV_POINTS; p += strspn(p, " ")) {
            char *end;
            const int t = (int)strtol(p, &end, 10);
            if (t <= steps) step[n++] = t;
            p = end;
        }
    else if (!e->method->sampled)
        for (int i = 0; i <= steps && n < EV_POINTS; i++) step[n++] = i;
    else {
        static const int leading[] = {1, 2, 5};
        step[n++] = 0;
        for (int64_t ten = 1; ten < steps; ten *= 10)
            for (int i = 0; i < 3; i++)
                if (leading[i] * ten < steps) step[n++] = (int)(leading[i] * ten);
        if (steps > 0) step[n++] = steps;
    }
    return n;
}

static size_t model_bytes(const nn_model *m) { return m ? m->count * sizeof(float) * (m->grad ? 2 : 1) : 0; }

size_t ev_bytes(const ev_estimator *e)
{
    size_t sum = e->bytes + model_bytes(e->net) + model_bytes(e->coder) + e->adam.count * 2 * sizeof(float);
    if (e->tape) sum += ts_arena_peak(ag_arena(e->tape));
    if (e->train) sum += ts_arena_peak(ag_arena(e->train));
    return sum;
}
