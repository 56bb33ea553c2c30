/* The run's state on disk: checkpoint.safetensors holds the parameters, Adam's moments and the moving average as whole
 * blocks (padding included, so that they come back bit by bit), and in its metadata the counters and the configuration.
 */
#include "data/ini.h"
#include "data/text.h"
#include "nn/weights/weights.h"
#include "tensor/cpu.h"
#include "train/state.h"
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char format_name[] = "lgd checkpoint";

static bool all_finite(const float *x, size_t n)
{
    bool fine = true;
    for (size_t i = 0; i < n; i++) fine &= isfinite(x[i]) != 0;
    return fine;
}

char *tr_config_text(const tr_config *c, ts_status *st)
{
    io_text text;
    if (io_text_begin(&text, "the configuration", st) != TS_OK) return NULL;
    tr_config_print(c, false, text.f);
    io_text_end(&text, "the configuration", st);
    return text.bytes;
}

ts_code tr_save_weights(tr_trainer *t, const char *name, ts_status *st)
{
    if (!tr_leads(t)) return TS_OK;
    char path[TR_PATH], step[32];
    char *text = tr_config_text(&t->config, st);
    if (!text) return st->code;
    tr_path(t, name, path);
    snprintf(step, sizeof step, "%" PRId64, t->step);
    const nn_meta extra[] = {{"train.step", step}, {"train.config", text}};
    const ts_code code = nn_model_save(t->model, tr_weights(t), path, extra, 2, st);
    free(text);
    return code;
}

/* The blocks of a checkpoint and how many there are: without a moving average three. */
static int blocks(const tr_trainer *t, nn_block out[4])
{
    const char *const name[] = {"parameters", "adam.m", "adam.v", "average"};
    const float *const data[] = {t->model->value, t->adam.m, t->adam.v, t->adam.ema};
    int n = 0;
    for (int i = 0; i < 4; i++)
        if (data[i])
            out[n++] = (nn_block){.name = name[i], .rank = 1, .dim = {(int64_t)t->model->count}, .data = data[i]};
    return n;
}

static ts_code save(tr_trainer *t, ts_status *st)
{
    char path[TR_PATH], number[7][32];
    nn_block block[4];
    const int n = blocks(t, block);
    for (int i = 0; i < n; i++)
        if (!all_finite(block[i].data, t->model->count))
            return ts_fail(st, TS_NUMERIC, "%s are not finite after step %" PRId64 ", the checkpoint before is kept",
                           block[i].name, t->step);
    if (tr_log_flush(t, st) != TS_OK) return st->code;
    /* Weights first: after a kill between the two the steps behind the checkpoint are made again. Before step 1 there
     * are none, so that a folder without a checkpoint has none either. */
    if (t->step > 0 && tr_save_weights(t, "last.safetensors", st) != TS_OK) return st->code;
    char *text = tr_config_text(&t->config, st);
    if (!text) return st->code;
    tr_path(t, "checkpoint.safetensors", path);
    snprintf(number[0], sizeof number[0], "%" PRId64, t->step);
    snprintf(number[1], sizeof number[1], "%" PRId64, t->adam.step);
    snprintf(number[2], sizeof number[2], "%" PRId64, t->skipped);
    snprintf(number[3], sizeof number[3], "%d", t->in_a_row);
    snprintf(number[4], sizeof number[4], "%.17g", t->best);
    snprintf(number[5], sizeof number[5], "%.17g", t->mean_norm);
    snprintf(number[6], sizeof number[6], "%d", t->ranks.count);
    nn_meta meta[12] = {{"format", format_name},
                        {"step", number[0]},
                        {"adam_step", number[1]},
                        {"skipped", number[2]},
                        {"skipped_in_a_row", number[3]},
                        {"best", number[4]},
                        {"mean_norm", number[5]},
                        {"isa", ts_isa_name(ts_isa_now())},
                        {"config", text}};
    int metas = 9; /* of one process, without a teacher, of procedural materials alone, no more */
    if (t->ranks.count > 1) meta[metas++] = (nn_meta){"ranks", number[6]};
    if (*t->teacher_hash) meta[metas++] = (nn_meta){"teacher", t->teacher_hash};
    if (*t->collection_hash) meta[metas++] = (nn_meta){"collection_files", t->collection_hash};
    const ts_code code = nn_safetensors_write(path, block, n, meta, metas, st);
    free(text);
    return code;
}

ts_code tr_save_checkpoint(tr_trainer *t, ts_status *st)
{
    const size_t bytes = t->model->count * sizeof(float);
    ts_code code = tr_same_bytes(&t->ranks, t->model->value, bytes, "its weights are no longer", st);
    if (!code) code = tr_agree(&t->ranks, tr_leads(t) ? save(t, st) : TS_OK, st);
    t->saved = !code;
    return code;
}

static ts_code read_count(const nn_file *file, const char *path, const char *key, int64_t *value, ts_status *st)
{
    const char *text = nn_file_meta(file, key);
    char *end = NULL;
    errno = 0;
    const long long v = text ? strtoll(text, &end, 10) : -1;
    if (!text || end == text || *end || errno || v < 0)
        return ts_fail(st, TS_FORMAT, "%s: %s is missing or no count", path, key);
    *value = v;
    return TS_OK;
}

static ts_code check_config(const tr_trainer *t, const nn_file *file, const char *path, ts_status *st)
{
    const char *text = nn_file_meta(file, "config");
    tr_config then = tr_config_default();
    io_ini ini;
    char where[TR_PATH + 32];
    if (!text) return ts_fail(st, TS_FORMAT, "%s: its configuration is missing", path);
    snprintf(where, sizeof where, "%s (config)", path);
    ts_code code = io_ini_parse(where, text, strlen(text), &ini, st);
    for (int i = 0; code == TS_OK && i < ini.count; i++)
        code = tr_config_set(&then, where, ini.entry[i].section, ini.entry[i].key, ini.entry[i].value, st);
    io_ini_free(&ini);
    return code == TS_OK ? tr_config_same(&then, &t->config, path, st) : code;
}

static ts_code restore(tr_trainer *t, const nn_file *file, const char *path, ts_status *st)
{
    const char *format = nn_file_meta(file, "format"), *best = nn_file_meta(file, "best"),
               *mean = nn_file_meta(file, "mean_norm");
    const int64_t dim[1] = {(int64_t)t->model->count};
    int64_t in_a_row = 0;
    nn_block block[4];
    if (!format || strcmp(format, format_name) != 0)
        return ts_fail(st, TS_FORMAT, "%s: is not a checkpoint of lgd-train", path);
    if (check_config(t, file, path, st) != TS_OK) return st->code;
    if (read_count(file, path, "step", &t->step, st) != TS_OK ||
        read_count(file, path, "adam_step", &t->adam.step, st) != TS_OK ||
        read_count(file, path, "skipped", &t->skipped, st) != TS_OK ||
        read_count(file, path, "skipped_in_a_row", &in_a_row, st) != TS_OK)
        return st->code;
    if (!best || !mean) return ts_fail(st, TS_FORMAT, "%s: %s is missing", path, best ? "mean_norm" : "best");
    if (t->step > tr_total(&t->config))
        return ts_fail(st, TS_FORMAT, "%s: step %" PRId64 " is beyond the end of the run", path, t->step);
    const char *collection = nn_file_meta(file, "collection_files"), *teacher = nn_file_meta(file, "teacher");
    snprintf(t->teacher_hash, sizeof t->teacher_hash, "%s", teacher ? teacher : "");
    snprintf(t->collection_hash, sizeof t->collection_hash, "%s", collection ? collection : "");
    t->best = strtod(best, NULL);
    t->mean_norm = strtod(mean, NULL);
    t->in_a_row = (int)(in_a_row < 1000000 ? in_a_row : 1000000);
    const int n = blocks(t, block);
    for (int i = 0; i < n; i++) {
        float *to = (float *)(uintptr_t)block[i].data;
        if (nn_file_read(file, block[i].name, 1, dim, to, st) != TS_OK) return ts_context(st, "%s", path);
        if (!all_finite(to, t->model->count))
            return ts_fail(st, TS_NUMERIC, "%s: %s holds values that are not finite", path, block[i].name);
    }
    return TS_OK;
}

ts_code tr_resume(tr_trainer *t, ts_status *st)
{
    char path[TR_PATH];
    tr_path(t, "checkpoint.safetensors", path);
    nn_file *file = nn_safetensors_open(path, st);
    if (!file) return ts_context(st, "nothing to resume");
    const ts_code code = restore(t, file, path, st);
    const char *isa = nn_file_meta(file, "isa"), *now = ts_isa_name(ts_isa_now());
    if (!code && isa && strcmp(isa, now) != 0)
        tr_note(t,
                "%s: warning: was made with the instruction set %s and goes on with %s: what follows differs from that "
                "of a run that was not interrupted (LGD_ISA chooses one)",
                path, isa, now);
    const char *ranks = nn_file_meta(file, "ranks");
    const int then = ranks ? atoi(ranks) : 1;
    if (!code && then != t->ranks.count)
        tr_note(t,
                "%s: was made by %d and goes on with %d rank%s: what follows differs by rounding from that of a run "
                "that was not interrupted",
                path, then, t->ranks.count, t->ranks.count > 1 ? "s" : "");
    nn_file_close(&file);
    t->saved = !code;
    return code;
}
