/* Steps that training skips. */
#include "tests/support/runs.h"
#include <math.h>
#include <unistd.h>

static void on_note(const char *line, void *user)
{
    ++*(int *)user;
    CHECK(*line && !strchr(line, '\n'), "not one line: %s", line);
}

/* Weights that overflow: every step is skipped and reported, nothing changes, the run stops, and no file holds a value
 * that is not finite. */
TEST(trainer_skips_steps_that_are_not_finite)
{
    tr_config c = small();
    ts_status st = {0};
    const char *where = folder("run");
    tr_row row;
    c.train.max_skipped = 3;
    c.train.pretrain_steps = 0; /* no change of phase on the way, which begins Adam anew */
    int notes = 0;
    const tr_listener l = {.note = on_note, .user = &notes};
    tr_trainer *t = tr_create(&c, where, false, NULL, &l, &st);
    CHECK(t, "%s", st.message);
    CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "%s", st.message);
    for (size_t i = 0; i < t->model->count; i++) t->model->value[i] *= 1e30f;
    const size_t bytes = t->model->count * sizeof(float);
    float *before = malloc(3 * bytes);
    memcpy(before, t->model->value, bytes);
    memcpy((char *)before + bytes, t->adam.m, bytes);
    memcpy((char *)before + 2 * bytes, t->adam.v, bytes);
    CHECK(tr_run(t, &st) == TS_NUMERIC, "went on: %s", st.message);
    CHECK(strstr(st.message, "4 steps in a row") && notes == 4, "%d notes: %s", notes, st.message);
    CHECK(t->skipped == 4 && t->step == 5, "%d skipped at step %d", (int)t->skipped, (int)t->step);
    CHECK(!memcmp(before, t->model->value, bytes) && !memcmp((char *)before + bytes, t->adam.m, bytes) &&
              !memcmp((char *)before + 2 * bytes, t->adam.v, bytes),
          "a skipped step changed the state");
    t->adam.ema[0] = NAN;
    CHECK(tr_save_checkpoint(t, &st) == TS_NUMERIC, "a checkpoint that is not finite was written");
    tr_destroy(&t);
    char path[700];
    size_t size;
    snprintf(path, sizeof path, "%s/checkpoint.safetensors", where);
    CHECK(access(path, F_OK) != 0, "%s exists", path);
    snprintf(path, sizeof path, "%s/last.safetensors", where);
    CHECK(access(path, F_OK) != 0, "%s exists", path);
    snprintf(path, sizeof path, "%s/log.csv", where);
    char *log = slurp(path, &size);
    CHECK(strstr(log, "nan,") && strstr(log, ",4\n"), "the log does not count the skipped steps: %s", log);
    free(log);
    free(before);
}

/* One batch whose gradient is out of all proportion: skipped with a reason, and the run goes on. */
TEST(trainer_skips_a_spike)
{
    tr_config c = small();
    ts_status st = {0};
    tr_row row;
    c.train.pretrain_steps = 0;
    c.train.steps = 1000;
    tr_trainer *t = tr_create(&c, folder("run"), false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "%s", st.message);
    CHECK(t->mean_norm == row.norm, "the mean norm is %g after a first of %g", t->mean_norm, row.norm);
    const double mean = t->mean_norm;
    t->mean_norm = row.norm / 1000;
    CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "a spike among the first steps was skipped: %s", row.skip);
    t->adam.step = 200;
    t->mean_norm = mean / 1000;
    CHECK(tr_step(t, &row, &st) == TS_OK && row.skip && strstr(row.skip, "train.spike"), "no spike was seen");
    CHECK(t->mean_norm == mean / 1000 && t->adam.step == 200 && t->in_a_row == 1, "a spike changed the state");
    t->mean_norm = mean;
    CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip && t->in_a_row == 0 && t->skipped == 1,
          "the run does not go on after a spike: %s", row.skip);
    t->config.train.spike = 0;
    t->mean_norm = mean / 1000;
    CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "0 does not turn it off");
    tr_destroy(&t);
}
