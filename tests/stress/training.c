/* A training run whose rate is ten times too high and whose inputs are spoilt now and then. The linker puts the two
 * functions below between the trainer and its data (--wrap), so that the product needs no door for it. */
#include "nn/weights/weights.h"
#include "tests/stress/stress.h"
#include "train/state.h"
#include "train/trainer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static struct {
    bool on;
    int batch, size;
    float *maps;
    ts_rng rng;
    long spoilt;
} poison;

const float *__real_io_loader_next(io_loader *loader, ts_status *st);
const float *__wrap_io_loader_next(io_loader *loader, ts_status *st);
void __real_tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                           const rd_view *views, int number, float *images, tr_shot *shots);
void __wrap_tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                           const rd_view *views, int number, float *images, tr_shot *shots);

/* One in two hundred: with maps and photographs, one in a hundred inputs. */
static void spoil(float *values, int count, size_t each)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f};
    for (int i = 0; i < count; i++) {
        if (ts_rng_int(&poison.rng, 200)) continue;
        const float v = bad[ts_rng_int(&poison.rng, 4)];
        const int every = 1 + ts_rng_int(&poison.rng, 50); /* all of it, or some */
        for (size_t k = 0; k < each; k += (size_t)every) values[(size_t)i * each + k] = v;
        poison.spoilt++;
    }
}

const float *__wrap_io_loader_next(io_loader *loader, ts_status *st)
{
    const float *maps = __real_io_loader_next(loader, st);
    if (!poison.on || !maps) return maps;
    const size_t each = (size_t)poison.size * (size_t)poison.size * MAP_CHANNELS;
    memcpy(poison.maps, maps, (size_t)poison.batch * each * sizeof *maps);
    spoil(poison.maps, poison.batch, each);
    return poison.maps;
}

void __wrap_tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                           const rd_view *views, int number, float *images, tr_shot *shots)
{
    __real_tr_photographs(c, seed, index, count, size, maps, views, number, images, shots);
    if (poison.on && count == poison.batch && size == poison.size)
        spoil(images, count, (size_t)size * (size_t)size * 3);
}

static bool finite_weights(const char *folder, const char *name)
{
    char path[1300];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    nn_model *m = nn_model_load(path, &st);
    if (!m) printf("%s\n", st.message);
    bool finite = m != NULL;
    for (size_t i = 0; m && i < m->count; i++) finite = finite && isfinite(m->value[i]);
    nn_model_free(&m);
    return finite;
}

typedef struct told {
    long steps, skipped;
} told;

static void step(const tr_row *row, void *user)
{
    told *t = user;
    t->steps = (long)row->step;
    t->skipped = (long)row->skipped_total;
}

static const char *name_of(ts_precision p) { return p == TS_BF16 ? "bf16" : "f32"; }

static bool bound(ts_precision p, const char *what, double measured)
{
    char text[128];
    snprintf(text, sizeof text, "training, %s: %s", name_of(p), what);
    return stress_row(text, measured, 0);
}

static bool train(const stress *s, ts_precision precision)
{
    static const char *const keys[] = {
        "model.g_width=4", "model.g_width_max=8", "model.g_levels=2", "model.g_size=16", "model.h_width=8",
        "model.h_gru=4",   "model.iterations=2",  "data.patch=16",    "data.threads=1",  "train.batch=2",
        "train.warmup=10", "train.ema=0.99",      "validate.count=4", "validate.size=16"};
    tr_config c = tr_config_default();
    ts_status st = {0};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (tr_config_set_assignment(&c, keys[i], &st)) return printf("%s\n", st.message), false;
    c.train.pretrain_steps = s->full ? 5000 : 100;
    c.train.steps = s->full ? 15000 : 300;
    c.train.precision = precision;
    c.train.rate *= 10;
    c.train.pretrain_rate *= 10;
    c.train.checkpoint_every = s->full ? 500 : 50;
    c.validate.every = s->full ? 5000 : 200;
    poison.batch = c.train.batch;
    poison.size = c.data.patch;
    poison.rng = ts_rng_make(5, TS_STREAM_TEST, 1);
    poison.spoilt = 0;
    poison.maps = malloc((size_t)poison.batch * (size_t)poison.size * (size_t)poison.size * MAP_CHANNELS *
                         sizeof *poison.maps);
    told seen = {0, 0};
    const tr_listener listener = {.step = step, .user = &seen};
    char folder[1200];
    snprintf(folder, sizeof folder, "%s/%s", s->folder, name_of(precision));
    mkdir(folder, 0777);
    tr_trainer *t = poison.maps ? tr_create(&c, folder, false, NULL, &listener, &st) : NULL;
    if (!t) {
        free(poison.maps);
        return printf("%s\n", st.message), false;
    }
    poison.on = true;
    const ts_code code = tr_run(t, &st);
    poison.on = false;
    tr_destroy(&t);
    free(poison.maps);
    const long all = c.train.pretrain_steps + c.train.steps;
    printf("training, %s: %ld of %ld steps, %ld inputs spoilt, %ld steps skipped; %s\n", name_of(precision), seen.steps,
           all, poison.spoilt, seen.skipped, code ? st.message : "to its end");
    bool ok = bound(precision, "stopped early without a reason", code ? !st.message[0] : seen.steps != all);
    ok = bound(precision, "no input was spoilt", poison.spoilt == 0) && ok;
    ok = bound(precision, "weights on disk that are not finite", !finite_weights(folder, "last.safetensors")) && ok;
    st = (ts_status){0};
    t = tr_create(&c, folder, true, NULL, NULL, &st); /* which refuses a checkpoint with a value that is not finite */
    if (!t) printf("%s\n", st.message);
    ok = bound(precision, "a checkpoint that does not resume", !t) && ok;
    tr_destroy(&t);
    return ok;
}

bool stress_training(const stress *s)
{
    const bool f32 = train(s, TS_F32);
    return train(s, TS_BF16) && f32;
}
