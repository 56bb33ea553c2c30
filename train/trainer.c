/* The run: what it owns, its folder, the loop over steps. */
#include "train/trainer.h"
#include "data/text.h"
#include "nn/weights/weights.h"
#include "tensor/cpu.h"
#include "tensor/new_file.h"
#include "train/state.h"
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

void tr_default_folder(const char *config_path, char *folder, size_t size)
{
    const char *slash = strrchr(config_path, '/'), *name = slash ? slash + 1 : config_path;
    size_t n = strlen(name);
    if (n >= 4 && !strcmp(name + n - 4, ".ini")) n -= 4;
    /* A name that says nothing, or would lead out of runs/. */
    if (n == 0 || (n == 1 && name[0] == '.') || (n == 2 && !strncmp(name, "..", 2))) name = "run", n = 3;
    snprintf(folder, size, "runs/%.*s", (int)n, name);
}

static ts_code lock_folder(tr_trainer *t, ts_status *st)
{
    char path[TR_PATH];
    tr_path(t, "lock", path);
    t->lock = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    const bool made = t->lock >= 0;
    if (!made) t->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (t->lock < 0) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    if (flock(t->lock, LOCK_EX | LOCK_NB) == 0) {
        t->new_lock = made;
        return TS_OK;
    }
    if (errno == EWOULDBLOCK)
        return ts_fail(st, TS_INVALID,
                       "%s: another lgd-train is at work in this folder (output.folder chooses another)", t->folder);
    return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
}

/* A run that cannot begin leaves the folder as it was. */
static void remove_lock(const tr_trainer *t)
{
    char path[TR_PATH];
    tr_path(t, "lock", path);
    unlink(path);
}

/* A run that was not asked to go on never overwrites one that can be gone on with. One without a checkpoint is begun
 * again. *resume: whether there is one to go on with. */
static ts_code check_folder(const tr_trainer *t, bool *resume, ts_status *st)
{
    char path[TR_PATH];
    tr_path(t, "checkpoint.safetensors", path);
    const bool there = access(path, F_OK) == 0;
    /* a checkpoint that cannot be looked at is none that a run may begin without */
    if (!there && errno != ENOENT) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    if (there && !*resume)
        return ts_fail(st, TS_INVALID,
                       "%s: there is a run already (checkpoint.safetensors): --resume goes on with it, output.folder "
                       "chooses another folder",
                       t->folder);
    if (!there && *resume) tr_note(t, "%s: has no checkpoint to resume from: the run begins at step 1", t->folder);
    *resume = there;
    return TS_OK;
}

/* Weights are hours of work. Where a run without a checkpoint has some, NAME.EXT becomes NAME-1.EXT, or gets the first
 * number that is free. */
static ts_code set_aside(const tr_trainer *t, ts_status *st)
{
    static const char *const names[][2] = {{"last", "safetensors"}, {"best", "safetensors"}, {"config", "ini"},
                                           {"log", "csv"},          {"val", "csv"},          {"curve", "svg"}};
    bool weights = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[TR_PATH], kept[TR_PATH], file[64];
        int number = 1;
        snprintf(file, sizeof file, "%s.%s", names[i][0], names[i][1]);
        tr_path(t, file, path);
        if (access(path, F_OK) != 0) continue;
        weights |= i < 2;
        if (!weights) break; /* the rest of a run that made none */
        do {
            snprintf(file, sizeof file, "%s-%d.%s", names[i][0], number++, names[i][1]);
            tr_path(t, file, kept);
        } while (access(kept, F_OK) == 0);
        if (rename(path, kept) != 0) return ts_fail(st, TS_IO, "%s: cannot be renamed: %s", path, strerror(errno));
        tr_note(t, "%s, of a run without a checkpoint, is kept as %s", path, file);
    }
    return TS_OK;
}

static ts_code write_config(const tr_trainer *t, ts_status *st)
{
    char path[TR_PATH];
    tr_path(t, "config.ini", path);
    io_text text;
    if (io_text_begin(&text, path, st) != TS_OK) return st->code;
    tr_config_print(&t->config, true, text.f);
    return io_text_write(&text, path, st);
}

/* The parameters that a run starts from. t: NULL, or the trainer that notes are reported to. */
static ts_code init_weights(nn_model *model, const tr_config *c, tr_trainer *t, ts_status *st)
{
    const char *const path[] = {c->train.init, c->train.init_rest};
    nn_model_init(model, (uint64_t)c->train.seed);
    bool *begun = calloc((size_t)model->params, sizeof *begun);
    if (!begun) return ts_fail(st, TS_NOMEM, "out of memory for %d parameters", model->params);
    ts_code code = TS_OK;
    for (int i = 0, taken, left; i < 2 && !code; i++) {
        if (!*path[i]) continue;
        code = nn_model_init_from(model, path[i], begun, &taken, &left, st);
        if (!code && t) tr_note(t, "%d parameters begin as in %s, %d as drawn", taken, path[i], left);
    }
    free(begun);
    return code;
}

ts_code tr_initial(const tr_config *config, const char *path, ts_status *st)
{
    nn_model *m = tr_model_create(config, st);
    if (!m) return st->code;
    ts_code code = init_weights(m, config, NULL, st);
    if (!code) code = nn_model_save(m, m->value, path, NULL, 0, st);
    nn_model_free(&m);
    return code;
}

/* What a rank has before it knows where the run stands; the folder is rank 0's. *resume: whether it goes on. */
static ts_code prepare(tr_trainer *t, bool *resume, ts_status *st)
{
    const tr_config *c = &t->config;
    const size_t batch = (size_t)t->batch, pixels = (size_t)c->data.patch * (size_t)c->data.patch;
    if (tr_leads(t)) {
        if (lock_folder(t, st) != TS_OK || check_folder(t, resume, st) != TS_OK) return st->code;
        ts_sweep(t->folder);
    }
    const size_t photographs = batch * (size_t)tr_most_given(c);
    t->images = malloc(photographs * pixels * 3 * sizeof(float));
    t->captures = malloc(photographs * sizeof *t->captures);
    t->scenes = malloc(photographs * RD_SCENE_NUMBERS * sizeof *t->scenes);
    t->known = malloc(photographs);
    t->shots = malloc(photographs * sizeof *t->shots);
    t->views = malloc(batch * RD_LOSS_VIEWS * sizeof *t->views);
    if (!t->images || !t->captures || !t->scenes || !t->known || !t->shots || !t->views)
        return ts_fail(st, TS_NOMEM, "no memory for %zu photographs", photographs);
    t->model = tr_model_create(c, st);
    if (!t->model || nn_model_train(t->model, st) != TS_OK ||
        (tr_leads(t) && !*resume && init_weights(t->model, c, t, st) != TS_OK))
        return st->code;
    if (nn_adam_create(&t->adam, t->model, (float)c->train.ema, st) != TS_OK) return st->code;
    if (tr_leads(t) && *resume && tr_resume(t, st) != TS_OK) return st->code;
    t->tape = ag_tape_create(true, st);
    if (*c->train.teacher && tr_teacher_load(t, st) != TS_OK) return st->code;
    if ((c->arch.revisions > 0 || t->teacher) && !(t->quiet = ag_tape_create(false, st))) return st->code;
    if (t->quiet) ag_freeze(t->quiet, true);
    if (!t->tape || (c->validate.every && tr_validator_create(t, st) != TS_OK)) return st->code;
    if (!t->ranks.mpi) return TS_OK;
    ag_watch(t->tape, tr_reduce_walked, &t->reducer);
    return tr_reducer_create(&t->reducer, t->ranks.mpi, t->model, (size_t)(c->train.bucket * (1 << 20)),
                             c->train.reduce, st);
}

/* Rank 0's weights, moments and counters to all. */
static void share_state(tr_trainer *t)
{
    const tr_mpi *mpi = t->ranks.mpi;
    float *const block[] = {t->model->value, t->adam.m, t->adam.v, t->adam.ema};
    int64_t count[] = {t->step, t->adam.step, t->skipped, t->in_a_row, t->saved};
    double real[] = {t->best, t->mean_norm};
    if (!mpi) return;
    for (int i = 0; i < 4; i++)
        if (block[i]) mpi->broadcast(block[i], t->model->count * sizeof(float));
    mpi->broadcast(count, sizeof count);
    mpi->broadcast(real, sizeof real);
    t->step = count[0], t->adam.step = count[1], t->skipped = count[2], t->in_a_row = (int)count[3];
    t->saved = count[4];
    t->best = real[0], t->mean_norm = real[1];
}

/* Ranks on one host have one block of weights, one of each moment and of the average from now on, of which each steps
 * its part. */
static void share_blocks(tr_trainer *t)
{
    float **const block[] = {&t->model->value, &t->adam.m, &t->adam.v, &t->adam.ema};
    const size_t count = t->model->count;
    const tr_world *w = &t->ranks.world;
    const int blocks = t->adam.ema ? 4 : 3;
    float *common, *gradient;
    if (!t->ranks.mpi || t->config.train.reduce != TR_REDUCE_F32) return;
    const char *why_not = t->ranks.mpi->share((size_t)blocks * count, count, &common, &gradient);
    if (why_not) {
        if (w->local > 1) tr_note(t, "%s: ranks on one host send each other their gradients", why_not);
        return;
    }
    for (int i = 0; i < blocks; i++, common += count) {
        if (w->local_rank == 0) memcpy(common, *block[i], count * sizeof *common);
        free(*block[i]);
        *block[i] = common;
    }
    free(t->model->grad);
    t->model->grad = gradient;
    t->reducer.parts = w->local;
    t->reducer.part = w->local_rank;
    t->ranks.mpi->meet();
}

/* What is shared belongs to MPI, and what it may still write to stays until the process ends. */
static void leave_blocks(tr_trainer *t)
{
    if (t->posted) t->model->grad = NULL;
    if (!t->reducer.parts) return;
    t->model->value = t->model->grad = NULL;
    t->adam.m = t->adam.v = t->adam.ema = NULL;
}

static ts_code begin(tr_trainer *t, bool resume, ts_status *st)
{
    const tr_config *c = &t->config;
    if (c->data.collected > 0 && tr_read_collection(t, st) != TS_OK) return ts_context(st, "data.collection");
    io_procedural source = tr_materials_of(c);
    source.collection = t->collection;
    const io_share share = {c->train.batch, t->first, t->batch};
    t->loader = io_loader_create(&source, c->data.patch, share, (uint64_t)t->step, c->data.prefetch, c->data.threads,
                                 st);
    if (!t->loader || !tr_leads(t)) return st->code;
    if ((!resume && set_aside(t, st) != TS_OK) || tr_log_open(t, st) != TS_OK) return st->code;
    return write_config(t, st);
}

/* An error that all ranks have is rank 0's to say. */
static ts_code all_fail(const tr_trainer *t, ts_status *st)
{
    if (!tr_leads(t)) *st->message = 0;
    return st->code;
}

/* One program, one configuration, one instruction set: otherwise the ranks' weights drift apart. */
static ts_code check_ranks(const tr_trainer *t, ts_status *st)
{
    const tr_config *c = &t->config;
    const char *isa = ts_isa_name(ts_isa_now());
    if (!t->ranks.mpi) return TS_OK;
    char *text = tr_config_text(c, st);
    ts_code code = tr_agree(&t->ranks, st->code, st);
    if (!code)
        code = tr_same_bytes(&t->ranks, isa, strlen(isa), "its CPU's instruction set (LGD_ISA chooses one) is not", st);
    if (!code) code = tr_same_bytes(&t->ranks, text, strlen(text), "its configuration is not", st);
    free(text);
    const int64_t met[] = {c->train.checkpoint_every, c->train.max_skipped};
    if (!code) code = tr_same_bytes(&t->ranks, met, sizeof met, "its train.checkpoint_every or max_skipped is not", st);
    if (code) return code;
    if (t->ranks.count > c->train.batch)
        ts_fail(st, TS_INVALID, "train.batch is %d: %d ranks cannot share it (start fewer)", c->train.batch,
                t->ranks.count);
    else if (c->coder.code == 0 && c->arch.rmse == NN_RMSE_BATCH)
        ts_fail(st, TS_INVALID,
                "model.rmse = batch takes an error over the whole batch, which several ranks do not have: set it "
                "to start, or train in one process");
    return st->code ? all_fail(t, st) : TS_OK;
}

static ts_code build(tr_trainer *t, bool resume, ts_status *st)
{
    if (check_ranks(t, st) != TS_OK) return st->code;
    t->batch = tr_share(&t->ranks, t->config.train.batch, &t->first);
    if (tr_agree(&t->ranks, prepare(t, &resume, st), st) != TS_OK) return st->code;
    share_state(t);
    share_blocks(t);
    ts_code code = tr_agree(&t->ranks, begin(t, resume, st), st);
    if (!code && t->teacher) code = tr_same_bytes(&t->ranks, t->teacher_hash, TR_HASH, "its train.teacher is not", st);
    if (!code && t->collection)
        code = tr_same_bytes(&t->ranks, t->collection_hash, TR_HASH, "its data.collection is not", st);
    return code;
}

tr_trainer *tr_create(const tr_config *config, const char *folder, bool resume, const tr_ranks *ranks,
                      const tr_listener *listener, ts_status *st)
{
    tr_trainer *t = calloc(1, sizeof *t);
    if (!t) {
        ts_fail(st, TS_NOMEM, "no memory for a trainer");
        return NULL;
    }
    t->config = *config;
    t->lock = -1;
    t->best = INFINITY;
    t->ranks = ranks ? *ranks : (tr_ranks){.count = 1};
    if (listener) t->listener = *listener;
    if (!tr_leads(t)) t->listener = (tr_listener){.stop = t->listener.stop, .user = t->listener.user};
    ts_code code = TS_OK;
    if (strlen(folder) >= sizeof t->folder)
        code = ts_fail(st, TS_INVALID, "the folder's name is longer than %zu bytes", sizeof t->folder - 1);
    else strcpy(t->folder, folder);
    if (code == TS_OK) code = tr_config_check(config, st);
    if (code == TS_OK) code = build(t, resume, st);
    if (code != TS_OK) {
        if (t->new_lock) remove_lock(t);
        tr_destroy(&t);
    }
    return t;
}

int64_t tr_step_now(const tr_trainer *t) { return t->step; }

void tr_destroy(tr_trainer **trainer)
{
    tr_trainer *t = *trainer;
    if (!t) return;
    io_loader_destroy(&t->loader);
    io_collection_free(&t->collection);
    tr_log_close(t);
    tr_validator_free(&t->validator);
    leave_blocks(t);
    tr_reducer_free(&t->reducer);
    ag_tape_destroy(&t->tape);
    ag_tape_destroy(&t->quiet);
    nn_adam_free(&t->adam);
    nn_model_free(&t->model);
    nn_model_free(&t->teacher);
    free(t->images);
    free(t->captures);
    free(t->scenes);
    free(t->known);
    free(t->shots);
    free(t->views);
    if (t->lock >= 0) close(t->lock);
    if (!t->posted) free(t);
    *trainer = NULL;
}

/* What follows a step: log, validation, checkpoint. */
static ts_code after_step(tr_trainer *t, const tr_row *row, ts_status *st)
{
    const tr_config *c = &t->config;
    const bool end = t->step == tr_total(c);
    t->saved = false;
    if (tr_leads(t) && tr_log_row(t, row, st) != TS_OK) return st->code;
    if (t->listener.step) t->listener.step(row, t->listener.user);
    if (row->skip) tr_note(t, "step %" PRId64 " is skipped: its %s (%d in a row)", t->step, row->skip, t->in_a_row);
    if (t->in_a_row > c->train.max_skipped) {
        tr_log_flush(t, st);
        ts_fail(st, TS_NUMERIC,
                "%d steps in a row had no loss and gradient to learn from: stopped at step %" PRId64
                ", the last checkpoint is kept (try a smaller train.rate)",
                t->in_a_row, t->step);
        return all_fail(t, st);
    }
    if (c->validate.every && (end || t->step % c->validate.every == 0)) {
        tr_validation v;
        if (tr_validate(t, &v, st) != TS_OK) return st->code;
        if (tr_leads(t) && (tr_log_validation(t, &v, st) != TS_OK || tr_curve_write(t, st) != TS_OK)) return st->code;
        if (t->listener.validated) t->listener.validated(&v, t->listener.user);
    }
    if (!end && t->step % c->train.checkpoint_every != 0) return TS_OK;
    if (tr_save_checkpoint(t, st) != TS_OK || !tr_leads(t)) return st->code;
    return tr_curve_write(t, st);
}

/* Whether the run is to end here; all ranks know it from the last step's sums. */
static bool stops(tr_trainer *t, bool first)
{
    const bool asked = t->listener.stop && t->listener.stop(t->listener.user);
    if (!t->ranks.mpi) return asked;
    return first ? tr_first_failed(&t->ranks, asked) >= 0 : t->stop;
}

static void note_waiting(const tr_trainer *t, int64_t steps)
{
    if (t->ranks.mpi && steps > 0)
        tr_note(t, "a step took %.2f ms, of which it waited %.2f ms (%.1f%%) for the gradients of %d ranks",
                1e3 * t->busy / (double)steps, 1e3 * t->waited / (double)steps, 100 * t->waited / t->busy,
                t->ranks.count);
}

ts_code tr_run(tr_trainer *t, ts_status *st)
{
    const int64_t begin_at = t->step;
    if (t->ranks.mpi)
        tr_note(t, "%s; gradients are summed as %s", t->ranks.world.where,
                t->config.train.reduce == TR_REDUCE_BF16 ? "bf16" : "f32");
    for (bool first = true; t->step < tr_total(&t->config); first = false) {
        tr_row row;
        const bool stop = stops(t, first);
        /* before step 1 too: a run that is killed at once can be resumed */
        if ((stop || t->step == 0) && !t->saved && tr_save_checkpoint(t, st) != TS_OK) return st->code;
        if (stop) {
            ts_fail(st, TS_INTERRUPTED, "interrupted at step %" PRId64 ", go on with --resume", t->step);
            return all_fail(t, st);
        }
        if (tr_step(t, &row, st) != TS_OK || after_step(t, &row, st) != TS_OK) return st->code;
    }
    note_waiting(t, t->step - begin_at);
    return begin_at == t->step ? tr_save_checkpoint(t, st) : TS_OK; /* of a complete run what was removed */
}
