/* curve.svg: how the run goes, drawn from its two logs. */
#include "cli/plot.h"
#include "data/file.h"
#include "data/text.h"
#include "train/state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 200, FIELDS = TR_MOST_ITERATIONS + 8 };
#define LOG_LIMIT ((size_t)1 << 30)

/* The columns of a log that are drawn, one after the other: means over BINS equal parts of the steps. */
typedef struct curve {
    const char *name;
    cl_point point[BINS];
    int points;
} curve;

/* The fields of a line, cut at commas, in place. */
static int split(char *line, char *field[FIELDS])
{
    int n = 0;
    for (char *at = line; at && n < FIELDS; n++) {
        field[n] = at;
        at = strchr(at, ',');
        if (at) *at++ = 0;
    }
    return n;
}

static int find(char *const field[], int fields, const char *name)
{
    for (int i = 0; i < fields; i++)
        if (!strcmp(field[i], name)) return i;
    return -1;
}

/* The next line of text, cut off; NULL at its end. */
static char *take_line(char **text)
{
    char *line = *text, *end = line ? strchr(line, '\n') : NULL;
    if (!end) return *text = NULL; /* what is not complete is being written */
    *end = 0;
    *text = end + 1;
    return line;
}

/* Of the column with that name, or where the name ends with '*' the last one of those that begin so and has a value. */
static void draw(char *text, const char *column, int64_t steps, curve *c)
{
    char *field[FIELDS], *copy = text, *line = take_line(&copy);
    double sum[BINS] = {0}, at[BINS] = {0};
    int count[BINS] = {0};
    const size_t length = strlen(column);
    const bool last = column[length - 1] == '*';
    const int heads = line ? split(line, field) : 0;
    const int first = last ? -1 : find(field, heads, column);
    bool wanted[FIELDS] = {false};
    for (int i = 0; i < heads; i++) wanted[i] = last ? !strncmp(field[i], column, length - 1) : i == first;
    while ((line = take_line(&copy))) {
        const int fields = split(line, field);
        const char *value = NULL;
        for (int i = 0; i < fields; i++)
            if (wanted[i] && *field[i]) value = field[i];
        if (!value) continue;
        const double step = strtod(field[0], NULL), v = strtod(value, NULL);
        const int bin = (int)fmin(fmax(step * BINS / fmax((double)steps, 1), 0), BINS - 1);
        if (!isfinite(v)) continue;
        sum[bin] += v, at[bin] += step, count[bin]++;
    }
    c->points = 0;
    for (int i = 0; i < BINS; i++)
        if (count[i]) c->point[c->points++] = (cl_point){.x = at[i] / count[i], .y = sum[i] / count[i]};
}

/* A fresh copy of the log each time: drawing cuts it up. */
static ts_code add(tr_trainer *t, const char *log, const char *column, const char *name, curve *c, ts_status *st)
{
    char path[TR_PATH], *text;
    size_t size;
    tr_path(t, log, path);
    if (io_read_bytes(path, LOG_LIMIT, &text, &size, st) != TS_OK) return st->code;
    c->name = name;
    draw(text, column, t->step, c);
    free(text);
    return TS_OK;
}

static ts_code write(tr_trainer *t, curve *c, ts_status *st)
{
    cl_series series[4];
    char path[TR_PATH];
    io_text text;
    int count = 0;
    ts_code code = add(t, "log.csv", "render_0", "first estimate, training", &c[0], st);
    if (!code) code = add(t, "log.csv", "render_T", "last step, training", &c[1], st);
    if (!code && t->validation_log) code = add(t, "val.csv", "render_0", "first estimate, validation", &c[2], st);
    if (!code && t->validation_log) code = add(t, "val.csv", "render_*", "last step, validation", &c[3], st);
    if (code) return code;
    for (int i = 0; i < 4; i++)
        if (c[i].points) series[count++] = (cl_series){.name = c[i].name, .point = c[i].point, .points = c[i].points};
    tr_path(t, "curve.svg", path);
    if (io_text_begin(&text, path, st) != TS_OK) return st->code;
    cl_plot_write(text.f, &(cl_axes){"step", "training: log-L1 of renderings; validation: RMSE", false}, series, count);
    return io_text_write(&text, path, st);
}

ts_code tr_curve_write(tr_trainer *t, ts_status *st)
{
    ts_status drawn = {0};
    if (tr_log_flush(t, st) != TS_OK) return st->code;
    curve *c = calloc(4, sizeof *c);
    if (!c) ts_fail(&drawn, TS_NOMEM, "out of memory");
    else write(t, c, &drawn);
    if (drawn.code) tr_note(t, "curve.svg is not drawn: %s", drawn.message);
    free(c);
    return TS_OK;
}
