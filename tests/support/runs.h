/* What the tests of training runs share: a tiny run, folders for it, and what it reports to its listener. */
#ifndef TESTS_RUNS_H
#define TESTS_RUNS_H
#include "tensor/threads.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include "train/state.h"
#include "train/trainer.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* As small as a run with every part in it can be: 4 steps of g alone, 6 of g and h with 1 to 3 iterations. */
static inline tr_config small(void)
{
    ts_threads_set(1); /* such small work is slower on several, most of all on a busy machine */
    tr_config c = tr_config_default();
    ts_status st = {0};
    static const char *const keys[] = {
        "model.g_width=4",  "model.g_width_max=8",    "model.g_levels=2",       "model.g_size=16",
        "model.h_width=8",  "model.h_gru=4",          "model.iterations=2",     "data.patch=24",
        "train.batch=2",    "train.pretrain_steps=4", "train.steps=6",          "train.warmup=2",
        "train.ema=0.9",    "train.iterations_min=1", "train.iterations_max=3", "train.checkpoint_every=100",
        "validate.every=3", "validate.count=3",       "validate.size=16",       "train.window=16"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        CHECK(tr_config_set_assignment(&c, keys[i], &st) == TS_OK, "%s", st.message);
    return c;
}

static inline const char *folder(const char *name)
{
    static char path[24][600]; /* more than a test has */
    static int next;
    char *p = path[next++ % 24];
    snprintf(p, 600, "%s/%s", test_folder(), name);
    mkdir(p, 0777);
    return p;
}
#endif
