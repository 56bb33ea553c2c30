/* Runs in which h learns to revise R_0. */
#include "nn/weights/weights.h"
#include "tests/support/runs.h"

typedef struct ending {
    int64_t after; /* steps, 0: never */
    tr_trainer *trainer;
} ending;

static bool on_stop(void *user)
{
    const ending *e = user;
    return e->after && tr_step_now(e->trainer) >= e->after;
}

static ts_code run(const tr_config *c, const char *where, bool resume, int64_t stop_after, ts_status *st)
{
    ending e = {.after = stop_after};
    const tr_listener l = {.stop = on_stop, .user = &e};
    *st = (ts_status){0};
    e.trainer = tr_create(c, where, resume, NULL, &l, st);
    if (!e.trainer) return st->code;
    const ts_code code = tr_run(e.trainer, st);
    tr_destroy(&e.trainer);
    return code;
}

static nn_model *weights(const char *where)
{
    char path[700];
    snprintf(path, sizeof path, "%s/last.safetensors", where);
    ts_status st = {0};
    nn_model *m = nn_model_load(path, &st);
    CHECK(m, "%s", st.message);
    return m;
}

/* Whether a part of the weights of two runs is the same. */
static bool same(const char *one, const char *two, nn_part part)
{
    nn_model *a = weights(one), *b = weights(two);
    size_t first, last;
    nn_model_range(a, part, &first, &last);
    const bool equal = !memcmp(a->value + first, b->value + first, (last - first) * sizeof(float));
    nn_model_free(&a);
    nn_model_free(&b);
    return equal;
}

/* h learns to revise what a fixed g says of several photographs: whatever the threads, resumed exactly, and g stays. */
TEST(trainer_teaches_revisions)
{
    static const char *const keys[] = {"model.unshuffle=4",      "model.g_detail=6",       "model.conditions=yes",
                                       "model.spread=yes",       "model.scene=yes",        "model.descent=posterior",
                                       "model.h_width=0",        "model.revisions=2",      "model.revise_width=8",
                                       "data.patch=64",          "validate.size=64",       "train.window=0",
                                       "train.g_rate=0",         "train.pretrain_steps=0", "train.steps=6",
                                       "train.iterations_min=0", "train.iterations_max=0", "train.disturb=0.7",
                                       "train.given_min=2",      "train.given_max=3",      "data.sheet=0.5"};
    ts_status st = {0};
    tr_config c = small();
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        CHECK(tr_config_set_assignment(&c, keys[i], &st) == TS_OK, "%s", st.message);
    const char *one = folder("one"), *three = folder("three"), *part = folder("part"), *on = folder("on");
    CHECK(run(&c, one, false, 0, &st) == TS_OK, "%s", st.message);
    ts_threads_set(3);
    CHECK(run(&c, three, false, 0, &st) == TS_OK, "%s", st.message);
    CHECK(run(&c, part, false, 4, &st) == TS_INTERRUPTED, "%s", st.message);
    CHECK(run(&c, part, true, 0, &st) == TS_OK, "%s", st.message);
    for (int p = NN_G; p <= NN_H; p++) {
        CHECK(same(one, three, (nn_part)p), "part %d depends on the number of threads", p);
        CHECK(same(one, part, (nn_part)p), "part %d is another after a stop", p);
    }
    snprintf(c.train.init, sizeof c.train.init, "%s/last.safetensors", one);
    CHECK(run(&c, on, false, 0, &st) == TS_OK, "%s", st.message);
    CHECK(same(one, on, NN_G), "g moved");
    CHECK(!same(one, on, NN_H), "h did not move");
    c.data.told_power = 0.5;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "told_power 0.5: h"), "%s",
          st.message);
    c.data.told_power = 1;
    c.data.patch = 128;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "data.patch"), "%s", st.message);
    c.data.patch = 64, c.train.given_min = 1;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "given_min"), "%s", st.message);
    c.train.given_min = 2, c.train.pretrain_steps = 1;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "given_max"), "%s", st.message);
    c.train.pretrain_steps = 0, c.train.given_min = c.train.given_max = c.arch.revisions = 0;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "disturb"), "%s", st.message);
    c.train.disturb = 0;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "train.steps"), "%s", st.message);
    c.arch.revisions = 2, c.train.given_max = 2, c.train.iterations_max = 2;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "iterations_max"), "%s",
          st.message);
    c.train.iterations_max = 0, c.train.g_rate = 0.5;
    CHECK(run(&c, folder("both"), false, 0, &st) == TS_INVALID && strstr(st.message, "g_rate"), "%s", st.message);
}
