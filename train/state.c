/* What the files of the trainer ask about a run. */
#include "train/state.h"
#include <stdarg.h>
#include <stdio.h>
#include <time.h>

void tr_path(const tr_trainer *t, const char *name, char path[TR_PATH])
{
    snprintf(path, TR_PATH, "%s/%s", t->folder, name);
}

void tr_note(const tr_trainer *t, const char *format, ...)
{
    char line[1400];
    va_list args;
    if (!t->listener.note) return;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    t->listener.note(line, t->listener.user);
}

int64_t tr_total(const tr_config *c) { return c->train.pretrain_steps + c->train.steps; }
bool tr_pretraining(const tr_config *c, int64_t step) { return step < c->train.pretrain_steps; }
const float *tr_weights(const tr_trainer *t) { return t->adam.ema ? t->adam.ema : t->model->value; }

double tr_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

nn_model *tr_model_create(const tr_config *c, ts_status *st)
{
    return c->coder.code > 0 ? nn_coder_create(&c->coder, st) : nn_model_create(&c->arch, st);
}
