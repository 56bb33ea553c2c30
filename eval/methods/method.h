/* The compared methods behind one interface: a photograph in, maps out, each step seen, time and memory accounted. A
 * file method_NAME.c each. */
#ifndef EV_METHOD_H
#define EV_METHOD_H
#include "eval/metrics/metrics.h"
#include "nn/adam.h"
#include <stdio.h>

typedef enum ev_setting_type { EV_WHOLE, EV_REAL, EV_WORD, EV_WEIGHTS } ev_setting_type;

/* A key of a method. One table a method parses, documents and is searched by --tune. */
typedef struct ev_setting {
    const char *key; /* NULL ends the table */
    ev_setting_type type;
    double lo, hi;       /* numbers */
    const char *words;   /* EV_WORD: its values, separated by blanks */
    const char *initial; /* the default; NULL: must be given, or (EV_WHOLE) as the weights say; "" for EV_WEIGHTS: the
                            program's model */
    const char *grid;    /* what is searched, separated by blanks; NULL: the default alone */
    bool steps;          /* the number of steps: one run of the most gives the results of all */
    const char *help;
} ev_setting;
enum { EV_SETTINGS = 9, EV_POINTS = 1024, EV_METHOD_TEXT = 4096 };

typedef struct ev_estimator ev_estimator;

/* Called with R_step: maps [size, size, channels] in the encoding of tensor/maps.h, valid during the call. false: stop.
 */
typedef bool (*ev_seen)(int step, const float *maps, int channels, void *user);

typedef struct ev_method {
    const char *name, *help;
    const ev_setting *settings;
    bool peer;                                       /* only of what has a peer's maps */
    bool sampled;                                    /* of many steps some are scored: 1, 2, 5, 10 ... (false: all) */
    int (*steps)(const ev_estimator *e);             /* after open; NULL: 0 */
    int (*photos)(const ev_estimator *e);            /* photographs that it reads, after open; NULL: 1 */
    ts_code (*open)(ev_estimator *e, ts_status *st); /* weights and tapes; on failure ev_close cleans up */
    /* Estimates the maps of c->image, a flash photograph of view c->view; step 0 is what it begins with. The same
     * numbers for any number of threads, whatever was estimated before. */
    ts_code (*run)(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st);
} ev_method;

extern const ev_method *const ev_methods[]; /* ended by NULL */

/* A method with its settings, and while it is open what it works with. */
struct ev_estimator {
    const ev_method *method;
    char label[64];
    bool labelled;                  /* it was given */
    char text[EV_METHOD_TEXT];      /* value points into it */
    const char *value[EV_SETTINGS]; /* by the table's index; NULL: neither given nor a default */
    const char *weights;            /* the program's model, for weights that are not given */
    const char *tried;              /* the steps to score, separated by blanks; NULL: the method's own */
    bool last_alone;                /* only the last step can be seen */
    bool exact;                     /* convolutions, as in tensor/compute.h; true until it is set */
    nn_model *net, *coder;          /* g (and h); an auto-encoder */
    ag_tape *tape, *train;          /* without and with gradients */
    nn_adam adam;
    float *kept;         /* a copy of parameters */
    float *x, *gradient; /* what is optimised, and its gradient: blocks */
    size_t count;        /* their numbers */
    size_t bytes;        /* of the blocks above */
    rd_view found; /* where the last run found the photograph's light and camera; c->view where it looks for none */
};

/* spec: NAME[:key=value,...]; every method also takes label=TEXT, by default spec. model and iterations (-1: none) are
 * the defaults of those keys. TS_INVALID with a message that begins with spec. */
ts_code ev_method_parse(const char *spec, const char *model, int iterations, ev_estimator *e, ts_status *st);
void ev_method_help(FILE *f);

ts_code ev_open(ev_estimator *e, ts_status *st);
void ev_close(ev_estimator *e);

/* Whether a tolerance decides how many steps are made, so that the last alone is scored. Parsed, not yet open. */
bool ev_ends_early(const ev_estimator *e);

/* How many photographs its settings say that it reads, 0: nothing is said; whether it has a number of iterations.
 * Parsed, not yet open. */
int ev_asked_photos(const ev_estimator *e);
bool ev_has_iterations(const ev_estimator *e);

/* The steps that are scored, the first and the last among them: ascending, at most EV_POINTS. Of an open one. */
int ev_points(const ev_estimator *e, int step[EV_POINTS]);

/* The most memory that it had at a time: weights, gradients, moments, tapes. Not the photograph, nor the threads'
 * scratch. */
size_t ev_bytes(const ev_estimator *e);

#endif
