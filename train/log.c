/* log.csv and val.csv. Rows that a resumed run will write again are removed first. */
#include "train/state.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char log_header[] =
    "step,phase,loss,render_0,map_0,render_T,map_T,spread,scene,iterations,gradient_norm,rate,samples_per_s,skipped\n";

/* The most maps after R_0 that are validated. */
static int most_maps(const tr_trainer *t)
{
    const nn_arch *a = &t->config.arch;
    return a->iterations > a->revisions ? a->iterations : a->revisions;
}

static void validation_header(const tr_trainer *t, char *text, size_t size)
{
    int n = snprintf(text, size, "step,");
    for (int k = 0; k <= most_maps(t); k++) n += snprintf(text + n, size - (size_t)n, "render_%d,", k);
    snprintf(text + n, size - (size_t)n, "diffuse,specular,roughness,normal,best\n");
}

/* Where the first row with a step beyond last begins, or a row that was not written to its end; -1 when the header is
 * not ours. */
static long cut_at(FILE *f, const char *header, int64_t last)
{
    char line[2048];
    long at = 0;
    if (!fgets(line, sizeof line, f) || strcmp(line, header) != 0) return -1;
    do {
        at = ftell(f);
        if (!fgets(line, sizeof line, f) || !strchr(line, '\n')) break;
    } while (strtoll(line, NULL, 10) <= last);
    return at;
}

static ts_code failed(const char *path, ts_status *st) { return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno)); }

static ts_code open_at(const tr_trainer *t, const char *name, const char *header, FILE **file, ts_status *st)
{
    char path[TR_PATH];
    tr_path(t, name, path);
    FILE *f = t->step > 0 ? fopen(path, "r+e") : NULL;
    if (f) {
        const long at = cut_at(f, header, t->step);
        if (at < 0) {
            fclose(f);
            return ts_fail(st, TS_FORMAT, "%s: is not the log of this run, remove it to go on", path);
        }
        if (fseek(f, at, SEEK_SET) != 0 || ftruncate(fileno(f), at) != 0) {
            const ts_code code = failed(path, st);
            fclose(f);
            return code;
        }
    } else {
        if (t->step > 0 && errno != ENOENT) return failed(path, st); /* it is there, and stays */
        f = fopen(path, "we");
        if (!f) return failed(path, st);
        if (fputs(header, f) == EOF || fflush(f) != 0) {
            const ts_code code = failed(path, st);
            fclose(f);
            return code;
        }
    }
    *file = f;
    return TS_OK;
}

ts_code tr_log_open(tr_trainer *t, ts_status *st)
{
    char header[16 * (TR_MOST_ITERATIONS + 8)];
    validation_header(t, header, sizeof header);
    if (open_at(t, "log.csv", log_header, &t->log, st) != TS_OK) return st->code;
    if (t->config.validate.every && open_at(t, "val.csv", header, &t->validation_log, st) != TS_OK) return st->code;
    return TS_OK;
}

/* An absent value is an empty field. The sign of a NaN says nothing and differs between CPUs. */
static void put(FILE *f, double v, bool absent_if_nan)
{
    if (isnan(v)) fputs(absent_if_nan ? "," : "nan,", f);
    else fprintf(f, "%.9g,", v);
}

ts_code tr_log_row(tr_trainer *t, const tr_row *row, ts_status *st)
{
    FILE *f = t->log;
    fprintf(f, "%lld,%s,", (long long)row->step, row->pretraining ? "g" : "gh");
    put(f, row->loss, false);
    put(f, row->render_start, true);
    put(f, row->map_start, true);
    put(f, row->render_end, true);
    put(f, row->map_end, true);
    put(f, row->spread, true);
    put(f, row->scene, true);
    fprintf(f, "%d,", row->iterations);
    put(f, row->norm, false);
    fprintf(f, "%.6g,%.2f,%lld\n", row->rate, row->batch / row->seconds, (long long)row->skipped_total);
    if (!ferror(f)) return TS_OK;
    return tr_log_flush(t, st);
}

ts_code tr_log_validation(tr_trainer *t, const tr_validation *v, ts_status *st)
{
    FILE *f = t->validation_log;
    fprintf(f, "%lld,", (long long)v->step);
    for (int k = 0; k <= most_maps(t); k++) put(f, k <= v->iterations ? v->render[k] : NAN, true);
    put(f, v->diffuse, false);
    put(f, v->specular, false);
    put(f, v->roughness, false);
    put(f, v->normal, false);
    fprintf(f, "%d\n", v->best);
    return tr_log_flush(t, st);
}

ts_code tr_log_flush(tr_trainer *t, ts_status *st)
{
    char path[TR_PATH];
    FILE *const file[] = {t->log, t->validation_log};
    const char *const name[] = {"log.csv", "val.csv"};
    for (int i = 0; i < 2; i++)
        if (file[i] && (fflush(file[i]) != 0 || ferror(file[i]))) {
            tr_path(t, name[i], path);
            return failed(path, st);
        }
    return TS_OK;
}

void tr_log_close(tr_trainer *t)
{
    if (t->log) fclose(t->log);
    if (t->validation_log) fclose(t->validation_log);
    t->log = t->validation_log = NULL;
}
