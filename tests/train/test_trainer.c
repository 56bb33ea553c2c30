/* Training runs: exact resume, threads, the folder's rules. */
#include "nn/weights/weights.h"
#include "tests/support/runs.h"
#include <math.h>
#include <unistd.h>

typedef struct watch {
    int64_t stop_at; /* 0: never; -1: before the first step */
    tr_trainer *trainer;
    int steps, validations, notes;
    const char *copy_from, *copy_to; /* copies a file after that step */
    int64_t copy_at;
} watch;

static void copy(const char *from, const char *to)
{
    size_t size;
    char *data = slurp(from, &size);
    spill(to, data, size);
    free(data);
}

static void on_step(const tr_row *row, void *user)
{
    watch *w = user;
    w->steps++;
    if (w->copy_at && row->step == w->copy_at + 1)
        copy(w->copy_from, w->copy_to); /* the checkpoint of copy_at was written before this step */
}
static void on_validation(const tr_validation *v, void *user)
{
    ((watch *)user)->validations++;
    for (int k = 0; k <= v->iterations; k++)
        CHECK(v->render[k] > 0 && v->render[k] < 1, "render RMSE %g of R_%d", v->render[k], k);
}
static void on_note(const char *line, void *user)
{
    ((watch *)user)->notes++;
    CHECK(*line && !strchr(line, '\n'), "not one line: %s", line);
}
static bool on_stop(void *user)
{
    const watch *w = user;
    return w->stop_at && tr_step_now(w->trainer) >= w->stop_at;
}

static ts_code run(const tr_config *c, const char *where, bool resume, watch *w, ts_status *st)
{
    const tr_listener l = {.step = on_step, .validated = on_validation, .note = on_note, .stop = on_stop, .user = w};
    *st = (ts_status){0};
    w->trainer = tr_create(c, where, resume, NULL, &l, st);
    if (!w->trainer) return st->code;
    const ts_code code = tr_run(w->trainer, st);
    tr_destroy(&w->trainer);
    return code;
}

static void run_whole(const tr_config *c, const char *where)
{
    watch w = {0};
    ts_status st;
    CHECK(run(c, where, false, &w, &st) == TS_OK, "%s", st.message);
    CHECK(w.steps == (int)tr_total(c), "%d steps", w.steps);
}

/* The speed's column, the last but one, is time: it is blanked. */
static void blank_speed(char *text)
{
    for (char *line = text; line && *line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL) {
        char *comma = line;
        for (int i = 0; i < 12; i++) comma = strchr(comma, ',') + 1;
        for (; *comma && *comma != ','; comma++) *comma = '_';
    }
    /* Blanks of equal length: times differ in their digits. */
    char *to = text;
    for (char *p = text; *p; p++)
        if (*p != '_' || p == text || p[-1] != '_') *to++ = *p;
    *to = 0;
}

static void expect_same_run(const char *a, const char *b)
{
    static const char *const names[] = {"checkpoint.safetensors", "last.safetensors", "best.safetensors", "val.csv",
                                        "log.csv"};
    for (int i = 0; i < 5; i++) {
        char path[700];
        size_t n, m;
        snprintf(path, sizeof path, "%s/%s", a, names[i]);
        char *x = slurp(path, &n);
        snprintf(path, sizeof path, "%s/%s", b, names[i]);
        char *y = slurp(path, &m);
        if (i == 4) {
            blank_speed(x);
            blank_speed(y);
            n = strlen(x);
            m = strlen(y);
        }
        CHECK(n == m && !memcmp(x, y, n), "%s differs", names[i]);
        free(x);
        free(y);
    }
}

TEST(trainer_resumes_exactly_after_every_step)
{
    const tr_config c = small();
    ts_status st;
    const char *whole = folder("whole");
    run_whole(&c, whole);
    for (int64_t k = 0; k < 10; k++) {
        char name[32];
        watch w = {.stop_at = k ? k : -1}, rest = {0};
        snprintf(name, sizeof name, "part%d", (int)k);
        const char *part = folder(name);
        CHECK(run(&c, part, false, &w, &st) == TS_INTERRUPTED && w.steps == (int)k, "stopped after %d steps: %s",
              w.steps, st.message);
        CHECK(strstr(st.message, "--resume"), "%s", st.message);
        CHECK(run(&c, part, true, &rest, &st) == TS_OK && rest.steps == 10 - (int)k, "resumed at %d: %s", (int)k,
              st.message);
        expect_same_run(whole, part);
    }
}

/* A folder with the files of a run that never had a checkpoint: it begins in it, whether or not it is asked to go on.
 */
TEST(trainer_begins_where_there_is_no_checkpoint)
{
    const tr_config c = small();
    ts_status st;
    char path[700];
    run_whole(&c, folder("whole"));
    for (int resume = 0; resume < 2; resume++) {
        watch w = {.stop_at = -1}, rest = {0};
        const char *where = folder(resume ? "resumed" : "begun");
        CHECK(run(&c, where, false, &w, &st) == TS_INTERRUPTED && w.steps == 0, "%d steps: %s", w.steps, st.message);
        snprintf(path, sizeof path, "%s/checkpoint.safetensors", where);
        CHECK(unlink(path) == 0, "there is no checkpoint before step 1");
        CHECK(run(&c, where, resume, &rest, &st) == TS_OK && rest.notes == resume, "%d notes: %s", rest.notes,
              st.message);
        expect_same_run(folder("whole"), where);
    }
}

/* A crash leaves log rows behind the last checkpoint: they are made again and not doubled. */
TEST(trainer_resumes_exactly_after_a_crash)
{
    tr_config c = small();
    ts_status st;
    const char *whole = folder("whole"), *crashed = folder("crashed");
    char checkpoint[700], kept[700];
    run_whole(&c, whole);
    snprintf(checkpoint, sizeof checkpoint, "%s/checkpoint.safetensors", crashed);
    snprintf(kept, sizeof kept, "%s/kept", crashed);
    watch w = {.copy_from = checkpoint, .copy_to = kept, .copy_at = 5}, rest = {0};
    c.train.checkpoint_every = 5;
    CHECK(run(&c, crashed, false, &w, &st) == TS_OK, "%s", st.message);
    rename(kept, checkpoint);
    char log[700];
    snprintf(log, sizeof log, "%s/log.csv", crashed);
    FILE *f = fopen(log, "a");
    fputs("11,gh,0.1", f); /* a row that was not finished */
    fclose(f);
    CHECK(run(&c, crashed, true, &rest, &st) == TS_OK && rest.steps == 5, "%d steps: %s", rest.steps, st.message);
    expect_same_run(whole, crashed);
}

TEST(trainer_makes_the_same_bytes_for_any_number_of_threads)
{
    tr_config c = small();
    static const char *const names[] = {"one", "two", "five"};
    const int threads[] = {1, 2, 5};
    for (int i = 0; i < 3; i++) {
        ts_threads_set(threads[i]);
        c.data.threads = 1 + i;
        c.data.prefetch = 1 + 2 * i;
        run_whole(&c, folder(names[i]));
        if (i) expect_same_run(folder("one"), folder(names[i]));
    }
}

TEST(trainer_seeds_matter)
{
    static const char *const change[] = {"data.seed=2",          "train.seed=2",
                                         "train.map_weight=0.5", "train.start_weight=0.5",
                                         "data.noise=0",         "train.clip=0.01"};
    char path[700];
    tr_config c = small();
    run_whole(&c, folder("first"));
    snprintf(path, sizeof path, "%s/last.safetensors", folder("first"));
    nn_model *a = nn_model_load(path, NULL);
    for (size_t i = 0; i < sizeof change / sizeof *change; i++) {
        char name[32];
        c = small();
        tr_config_set_assignment(&c, change[i], NULL);
        snprintf(name, sizeof name, "other%d", (int)i);
        const char *where = folder(name);
        run_whole(&c, where);
        snprintf(path, sizeof path, "%s/last.safetensors", where);
        nn_model *b = nn_model_load(path, NULL);
        CHECK(a && b && a->count == b->count, "the weights cannot be read");
        CHECK(memcmp(a->value, b->value, a->count * sizeof(float)) != 0, "%s changes nothing", change[i]);
        nn_model_free(&b);
    }
    nn_model_free(&a);
}

TEST(trainer_pretraining_leaves_the_refiner_alone)
{
    tr_config c = small();
    ts_status st = {0};
    size_t first, last;
    char path[700];
    c.train.ema = 0;
    c.train.steps = 0;
    run_whole(&c, folder("g"));
    snprintf(path, sizeof path, "%s/last.safetensors", folder("g"));
    nn_model *trained = nn_model_load(path, &st), *start = nn_model_create(&c.arch, &st);
    CHECK(trained && start, "%s", st.message);
    nn_model_init(start, (uint64_t)c.train.seed);
    nn_model_range(start, NN_H, &first, &last);
    CHECK(last > first && !memcmp(trained->value + first, start->value + first, (last - first) * sizeof(float)),
          "h changed");
    nn_model_range(start, NN_G, &first, &last);
    CHECK(memcmp(trained->value + first, start->value + first, (last - first) * sizeof(float)) != 0,
          "g did not change");
    nn_model_free(&trained);
    nn_model_free(&start);
}

/* The loss of the first step, and of the last ten. */
static void learn(ts_precision precision, const char *where, double *first, double *last)
{
    tr_config c = small();
    ts_status st = {0};
    c.train.pretrain_steps = 60;
    c.train.steps = 0;
    c.train.precision = precision;
    c.validate.every = 0;
    double early = 0, late = 0;
    tr_trainer *t = tr_create(&c, where, false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    for (int i = 0; i < 60; i++) {
        tr_row row;
        CHECK(tr_step(t, &row, &st) == TS_OK, "%s", st.message);
        CHECK(fabs(row.loss - (row.render_start + row.map_start)) < 1e-5 * row.loss,
              "the loss is not the sum of its parts");
        if (i == 0) *first = row.loss;
        if (i < 10) early += row.loss / 10;
        if (i >= 50) late += row.loss / 10;
    }
    tr_destroy(&t);
    CHECK(late < 0.8 * early, "%s: the loss went from %g to %g only", precision == TS_BF16 ? "bf16" : "f32", early,
          late);
    *last = late;
}

TEST(trainer_learns_a_little)
{
    double first[2], last[2];
    learn(TS_F32, folder("learn"), &first[0], &last[0]);
    learn(TS_BF16, folder("learn_bf16"), &first[1], &last[1]);
    CHECK(first[0] != first[1] && fabs(first[0] - first[1]) < 0.005 * first[0],
          "the first step's loss is %g, in bf16 %g", first[0], first[1]);
    CHECK(fabs(last[0] - last[1]) < 0.1 * last[0], "the loss ends at %g, in bf16 at %g", last[0], last[1]);
}

TEST(trainer_in_bf16_keeps_the_rules)
{
    tr_config c = small();
    ts_status st;
    watch w = {.stop_at = 7}, rest = {0};
    c.train.precision = TS_BF16;
    run_whole(&c, folder("whole"));
    CHECK(run(&c, folder("part"), false, &w, &st) == TS_INTERRUPTED, "%s", st.message);
    ts_threads_set(3);
    CHECK(run(&c, folder("part"), true, &rest, &st) == TS_OK, "%s", st.message);
    expect_same_run(folder("whole"), folder("part"));
    c.train.precision = TS_F32;
    CHECK(run(&c, folder("whole"), true, &rest, &st) == TS_INVALID && strstr(st.message, "precision"), "'%s'",
          st.message);
}

TEST(trainer_refuses_another_configuration_by_key)
{
    tr_config c = small();
    ts_status st;
    watch w = {.stop_at = 2};
    const char *where = folder("run");
    CHECK(run(&c, where, false, &w, &st) == TS_INTERRUPTED, "%s", st.message);
    tr_config other = c;
    other.train.rate = 0.002;
    w.stop_at = 0;
    CHECK(run(&other, where, true, &w, &st) == TS_INVALID && strstr(st.message, "train.rate") &&
              strstr(st.message, "0.001"),
          "%s", st.message);
    other = c;
    other.arch.h_width = 16;
    CHECK(run(&other, where, true, &w, &st) == TS_INVALID && strstr(st.message, "model.h_width"), "%s", st.message);
    other = c;
    other.train.steps = 7;
    CHECK(run(&other, where, true, &w, &st) == TS_INVALID && strstr(st.message, "train.steps"), "%s", st.message);
    CHECK(run(&c, where, false, &w, &st) == TS_INVALID && strstr(st.message, "--resume"), "a run was overwritten: %s",
          st.message);
    other = c;
    other.data.threads = 3; /* changes no byte */
    CHECK(run(&other, where, true, &w, &st) == TS_OK, "%s", st.message);
}

TEST(trainer_locks_its_folder)
{
    const tr_config c = small();
    ts_status st = {0};
    const char *where = folder("run");
    tr_trainer *t = tr_create(&c, where, false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    tr_trainer *second = tr_create(&c, where, false, NULL, NULL, &st);
    CHECK(!second && st.code == TS_INVALID && strstr(st.message, "another lgd-train"), "%s", st.message);
    tr_destroy(&t);
    st = (ts_status){0};
    t = tr_create(&c, where, false, NULL, NULL, &st);
    CHECK(t, "the lock outlived its trainer: %s", st.message);
    tr_destroy(&t);
}

TEST(trainer_that_cannot_begin_leaves_nothing)
{
    tr_config c = small();
    ts_status st = {0};
    const char *where = folder("run");
    snprintf(c.train.init, sizeof c.train.init, "%s/none.safetensors", where);
    tr_trainer *t = tr_create(&c, where, false, NULL, NULL, &st);
    CHECK(!t && st.code != TS_OK, "weights that are not there are taken");
    CHECK(rmdir(where) == 0, "%s: files are left", where);
}

TEST(trainer_rejects_damaged_checkpoints)
{
    const tr_config c = small();
    ts_status st;
    watch w = {.stop_at = 1};
    char path[700];
    const char *where = folder("run");
    CHECK(run(&c, where, false, &w, &st) == TS_INTERRUPTED, "%s", st.message);
    snprintf(path, sizeof path, "%s/checkpoint.safetensors", where);
    size_t n;
    char *data = slurp(path, &n);
    const size_t cut[] = {0, 7, 8, 100, n / 2, n - 1};
    for (int i = 0; i < 6; i++) {
        spill(path, data, cut[i]);
        CHECK(run(&c, where, true, &w, &st) != TS_OK && strstr(st.message, path), "cut to %d bytes: %s", (int)cut[i],
              st.message);
    }
    const float nan = NAN;
    memcpy(data + n - sizeof nan, &nan, sizeof nan);
    spill(path, data, n);
    CHECK(run(&c, where, true, &w, &st) == TS_NUMERIC, "a value that is not finite was accepted: %s", st.message);
    char last[700];
    snprintf(last, sizeof last, "%s/last.safetensors", where);
    copy(last, path);
    CHECK(run(&c, where, true, &w, &st) == TS_FORMAT && strstr(st.message, "checkpoint"),
          "weights were taken for a checkpoint: %s", st.message);
    free(data);
}

TEST(trainer_starts_from_given_weights)
{
    tr_config c = small(), other = small();
    ts_status st = {0};
    run_whole(&c, folder("first"));
    snprintf(c.train.init, sizeof c.train.init, "%s/last.safetensors", folder("first"));
    nn_model *given = nn_model_load(c.train.init, &st);
    CHECK(given, "%s", st.message);
    tr_trainer *t = tr_create(&c, folder("second"), false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    CHECK(!memcmp(t->model->value, given->value, given->count * sizeof(float)),
          "the run does not begin with the given weights");
    CHECK(!memcmp(t->adam.ema, given->value, given->count * sizeof(float)),
          "the moving average does not begin with the given weights");
    tr_destroy(&t);
    nn_model_free(&given);
    strcpy(other.train.init, "/nonexistent/x.safetensors");
    t = tr_create(&other, folder("third"), false, NULL, NULL, &st);
    CHECK(!t && strstr(st.message, "/nonexistent/x.safetensors"), "%s", st.message);
}
