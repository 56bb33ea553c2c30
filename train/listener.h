/* What a training run says while it goes on. */
#ifndef TR_LISTENER_H
#define TR_LISTENER_H
#include <stdbool.h>
#include <stdint.h>

/* One step as log.csv has it. NaN in a part: that loss has no weight or does not exist in this phase. */
typedef struct tr_row {
    int64_t step, total; /* steps made so far, this one included, and to make */
    bool pretraining, g_fixed;
    const char *skip;                                          /* why the step made no update; NULL: it made one */
    int iterations;                                            /* refinement steps that were drawn */
    double loss, render_start, map_start, render_end, map_end; /* of R_0 and R_T */
    double spread, scene; /* likelihoods of R_0's errors and of the scene (model.spread, model.scene); of a step that
                             train.teacher teaches, how far the model says others than it */
    double norm, rate;
    double seconds; /* that the step took */
    double waited;  /* of them, for other ranks' gradients */
    int batch;
    int64_t skipped_total;
} tr_row;

enum { TR_MOST_ITERATIONS = 64 };

typedef struct tr_validation {
    int64_t step;
    int iterations;                        /* 0 while g is trained alone */
    double render[TR_MOST_ITERATIONS + 1]; /* mean RMSE of 20 renderings of R_0 … R_iterations, see render/error.h */
    double diffuse, specular, roughness, normal; /* mean RMSE of the last maps */
    bool best;                                   /* the least so far in this phase, and therefore saved */
} tr_validation;

/* Callbacks, on the calling thread; any may be NULL. note: one line. stop: asked between steps. Of several ranks, rank
 * 0 has all of them and the others stop: all ranks stop when one of them is asked to. */
typedef struct tr_listener {
    void (*step)(const tr_row *row, void *user);
    void (*validated)(const tr_validation *v, void *user);
    void (*note)(const char *line, void *user);
    bool (*stop)(void *user);
    void *user;
} tr_listener;
#endif
