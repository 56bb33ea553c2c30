/* What the methods' files are made of. */
#ifndef EV_METHOD_INTERNAL_H
#define EV_METHOD_INTERNAL_H
#include "eval/methods/method.h"
#include "infer/estimate.h"

/* The index of a key in a table, -1: none; of a word among words separated by blanks. */
int ev_find(const ev_setting *settings, const char *key);
int ev_word(const char *words, const char *word);
/* A setting's value; of EV_WORD the index. */
double ev_number(const ev_estimator *e, const char *key);
const char *ev_text(const ev_estimator *e, const char *key);
bool ev_given(const ev_estimator *e, const char *key);

/* Settings that several methods have, and what asks for them. */
#define EV_START(text)                                                                                                \
    {                                                                                                                 \
        .key = "start", .type = EV_WORD, .words = "r0 constant", .initial = "r0", .grid = "r0 constant", .help = text \
    }
#define EV_START_MAPS EV_START("R_0 of the model, or the mean of procedural materials")
#define EV_ADAM_RATE(first, all)                                                                                \
    {                                                                                                           \
        .key = "rate", .type = EV_REAL, .lo = 0, .hi = 10, .initial = first, .grid = all, .help = "Adam's rate" \
    }
#define EV_STEPS(first, all)                                                                                   \
    {                                                                                                          \
        .key = "steps", .type = EV_WHOLE, .lo = 0, .hi = 100000, .initial = first, .grid = all, .steps = true, \
        .help = "number of steps"                                                                              \
    }
#define EV_PHOTOS                                                                           \
    {                                                                                       \
        .key = "photos", .type = EV_WHOLE, .lo = 1, .hi = RD_CAPTURE_VIEWS, .initial = "1", \
        .help = "number of photographs"                                                     \
    }
#define EV_MODEL(name, text)                                         \
    {                                                                \
        .key = name, .type = EV_WEIGHTS, .initial = "", .help = text \
    }
#define EV_MODEL_R0(name) EV_MODEL(name, "weights for R_0 (default: the program's)")
/* Of the methods that have this key: lgd_options.orientations; of the others 1. */
#define EV_ORIENTATIONS                                                                                          \
    {                                                                                                            \
        .key = "orientations", .type = EV_WORD, .words = "1 2 4 8 auto", .initial = "1",                         \
        .help = "of the photograph that R_0 is the mean of, as lgd-infer --orientations (whose default is auto)" \
    }
int ev_steps(const ev_estimator *e);  /* of "steps" */
int ev_photos(const ev_estimator *e); /* of "photos" */
/* How many of the case's photographs the method reads: it may have fewer than the method can read. */
int ev_inputs(const ev_estimator *e, const ev_case *c);
int ev_orientations(const ev_estimator *e);
/* e->net from the key's weights, and the tape without gradients. */
ts_code ev_open_net(ev_estimator *e, const char *key, ts_status *st);
/* The same where "start" says R_0, else nothing. */
ts_code ev_open_start(ev_estimator *e, const char *key, ts_status *st);
ts_code ev_open_train(ev_estimator *e, ts_status *st);
/* What the estimator (infer/estimate.h) is given beside what the method's settings say: exactness, orientations. */
typedef struct ev_run_how {
    lgd_photo photo[NN_MAX_IMAGES];
    int photos;
    lgd_options options; /* size, exact, orientations and threads are set by ev_run */
    bool g_alone;        /* as in lgd_estimator */
} ev_run_how;
/* Estimates as lgd-infer does; each step is seen. */
ts_code ev_run(ev_estimator *e, const ev_case *c, const ev_run_how *how, ev_seen seen, void *user, ts_status *st);
/* image under view, whose light and camera are points. */
void ev_photo_of(const rd_view *view, const float *image, lgd_photo *photo);
/* g's own maps of the first photograph under c->view: step 0 is seen. What the estimator fits before its steps is not
 * in them (lgd_estimator.g_alone). */
ts_code ev_run_g(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st);
/* The same maps, [size, size, MAP_CHANNELS]. */
ts_code ev_start_r0(ev_estimator *e, const ev_case *c, float *maps, ts_status *st);
/* The mean of procedural materials; and one material for every pixel. */
ts_code ev_mean(float mean[MAP_CHANNELS], ts_status *st);
void ev_fill(const ev_case *c, const float mean[MAP_CHANNELS], float *maps);
/* Every pixel the mean of procedural materials. */
ts_code ev_start_mean(const ev_case *c, float *maps, ts_status *st);
/* What "start" says, of a method that ev_open_start has opened. */
ts_code ev_start(ev_estimator *e, const ev_case *c, float *maps, ts_status *st);
/* e->x and e->gradient of so many numbers, and Adam for them; nothing is done where they exist. Moments and gradient
 * are zeroed. */
ts_code ev_block(ev_estimator *e, size_t count, ts_status *st);
/* One update of e->x from e->gradient, which is zeroed. */
void ev_block_step(ev_estimator *e, float rate);
#endif
