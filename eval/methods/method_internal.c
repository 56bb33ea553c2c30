#include "eval/methods/method_internal.h"
#include "cli/cli.h"
#include "nn/weights/weights.h"
#include "tensor/memory.h"
#include "tensor/threads.h"
#include <stdlib.h>
#include <string.h>

int ev_find(const ev_setting *settings, const char *key)
{
    for (int i = 0; settings[i].key; i++)
        if (!strcmp(settings[i].key, key)) return i;
    return -1;
}

int ev_word(const char *words, const char *word)
{
    const size_t n = strlen(word);
    for (int i = 0; *words; i++) {
        const size_t length = strcspn(words, " ");
        if (length == n && !strncmp(words, word, n)) return i;
        words += length + strspn(words + length, " ");
    }
    return -1;
}

const char *ev_text(const ev_estimator *e, const char *key)
{
    const int i = ev_find(e->method->settings, key);
    return i < 0 ? NULL : e->value[i];
}

bool ev_given(const ev_estimator *e, const char *key) { return ev_text(e, key) != NULL; }

double ev_number(const ev_estimator *e, const char *key)
{
    const char *text = ev_text(e, key);
    const ev_setting *s = &e->method->settings[ev_find(e->method->settings, key)];
    double v = 0;
    if (!text) return -1;
    if (s->type == EV_WORD) return ev_word(s->words, text);
    cl_parse_real(text, s->lo, s->hi, &v);
    return v;
}

int ev_orientations(const ev_estimator *e)
{
    static const int values[] = {1, 2, 4, 8, LGD_ORIENTATIONS_DEFAULT};
    return ev_find(e->method->settings, "orientations") >= 0 ? values[(int)ev_number(e, "orientations")] : 1;
}

int ev_steps(const ev_estimator *e) { return (int)ev_number(e, "steps"); }
int ev_photos(const ev_estimator *e) { return (int)ev_number(e, "photos"); }

int ev_inputs(const ev_estimator *e, const ev_case *c)
{
    const int most = e->method->photos ? e->method->photos(e) : 1;
    return most < c->inputs ? most : c->inputs;
}

ts_code ev_open_net(ev_estimator *e, const char *key, ts_status *st)
{
    e->net = nn_model_load(ev_text(e, key), st);
    if (e->net) e->tape = ag_tape_create(false, st);
    if (!e->tape) return st->code;
    ag_compute_set(e->tape, (ts_compute){.exact = e->exact});
    ag_freeze(e->tape, true);
    return TS_OK;
}

ts_code ev_open_start(ev_estimator *e, const char *key, ts_status *st)
{
    return ev_number(e, "start") == 0 ? ev_open_net(e, key, st) : TS_OK;
}

ts_code ev_open_train(ev_estimator *e, ts_status *st)
{
    e->train = ag_tape_create(true, st);
    if (!e->train) return st->code;
    ag_compute_set(e->train, (ts_compute){.exact = e->exact});
    return TS_OK;
}

ts_code ev_run(ev_estimator *e, const ev_case *c, const ev_run_how *how, ev_seen seen, void *user, ts_status *st)
{
    const lgd_estimator estimator = {
        .net = e->net, .tape = e->tape, .g_alone = how->g_alone, .seen = seen, .user = user};
    lgd_options options = how->options;
    options.size = sizeof options;
    options.exact = e->exact;
    options.orientations = ev_orientations(e);
    options.threads = ts_threads();
    lgd_photo taken[NN_MAX_IMAGES] = {0};
    double ambient = 0;
    options.taken = taken, options.ambient = &ambient;
    float *maps = malloc((size_t)c->size * (size_t)c->size * MAP_CHANNELS * sizeof *maps);
    const ts_code code = maps ? lgd_estimator_run(&estimator, how->photo, how->photos, c->size, &options, maps, st)
                              : ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", c->size, c->size);
    free(maps);
    if (!code && !how->g_alone) {
        e->found = (rd_view){.kind = RD_POINT, .power = taken[0].power, .ambient = (float)ambient};
        memcpy(e->found.light, taken[0].light, sizeof e->found.light);
        memcpy(e->found.camera, taken[0].camera, sizeof e->found.camera);
    }
    return code;
}

void ev_photo_of(const rd_view *view, const float *image, lgd_photo *photo)
{
    *photo = (lgd_photo){.image = image, .power = view->power};
    memcpy(photo->light, view->light, sizeof photo->light);
    memcpy(photo->camera, view->camera, sizeof photo->camera);
}

ts_code ev_run_g(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    ev_run_how how = {.photos = 1, .options = {.fov = LGD_FOV_OF_PHOTO}, .g_alone = true};
    ev_photo_of(&c->view, c->image, &how.photo[0]);
    return ev_run(e, c, &how, seen, user, st);
}

typedef struct copy_of {
    float *maps;
    int64_t pixels;
} copy_of;

static bool copy(int step, const float *maps, int channels, void *user)
{
    const copy_of *to = user;
    for (int64_t i = 0; i < to->pixels; i++)
        memcpy(to->maps + i * MAP_CHANNELS, maps + i * channels, MAP_CHANNELS * sizeof *maps);
    return step > 0;
}

ts_code ev_start_r0(ev_estimator *e, const ev_case *c, float *maps, ts_status *st)
{
    return ev_run_g(e, c, copy, &(copy_of){maps, (int64_t)c->size * c->size}, st);
}

ts_code ev_start(ev_estimator *e, const ev_case *c, float *maps, ts_status *st)
{
    return e->net ? ev_start_r0(e, c, maps, st) : ev_start_mean(c, maps, st);
}

ts_code ev_block(ev_estimator *e, size_t count, ts_status *st)
{
    count = (count + 15) / 16 * 16;
    if (e->count != count) {
        free(e->x);
        free(e->gradient);
        nn_adam_free(&e->adam);
        e->x = ts_memory(count * sizeof *e->x);
        e->gradient = ts_memory(count * sizeof *e->gradient);
        const nn_model numbers = {.count = count, .value = e->x}; /* all that Adam looks at */
        if (!e->x || !e->gradient || nn_adam_create(&e->adam, &numbers, 0, st) != TS_OK)
            return ts_fail(st, TS_NOMEM, "out of memory for %zu numbers", count);
        e->count = count;
        e->bytes = 2 * count * sizeof *e->x;
    }
    memset(e->gradient, 0, count * sizeof *e->gradient);
    memset(e->x, 0, count * sizeof *e->x);
    memset(e->adam.m, 0, count * sizeof *e->x);
    memset(e->adam.v, 0, count * sizeof *e->x);
    e->adam.step = 0;
    return TS_OK;
}

void ev_block_step(ev_estimator *e, float rate)
{
    nn_model numbers = {.count = e->count, .value = e->x, .grad = e->gradient};
    nn_adam_next(&e->adam);
    nn_adam_step(&e->adam, &numbers, 0, e->count, rate, 1);
}
