/* A training run in a folder: steps, validation, checkpoints and the log. Everything random is a function of (seed,
 * step), so that a resumed run makes the same bytes as one that was not interrupted, for any number of threads.
 *
 * Two phases. The first, pretrain_steps long, trains g alone on R_0's loss; the second trains g and h on R_T's and
 * R_0's. Each has its own warm-up, cosine and Adam moments, since the two losses differ.
 *
 * Several ranks (train/ranks.h) make one run: train.batch is the batch of all, of which each makes its share, the same
 * materials for any number of ranks; gradients are summed, and every rank makes the same update. Rank 0 alone has the
 * folder. The same number of ranks makes the same bytes; another one the same numbers to rounding.
 *
 * The folder's files: config.ini (as it runs), log.csv (a row a step), val.csv (a row a validation), best.safetensors
 * (weights with the least validated error in the phase), last.safetensors (weights at the last checkpoint after
 * step 1), checkpoint.safetensors (what --resume reads; there before step 1), lock. */
#ifndef TR_TRAINER_H
#define TR_TRAINER_H
#include "train/config.h"
#include "train/ranks.h"

/* One step as log.csv has it. NaN in a part: that loss has no weight or does not exist in this phase. */
typedef struct tr_row {
    int64_t step, total; /* steps made so far, this one included, and to make */
    bool pretraining;
    const char *skip;                                          /* why the step made no update; NULL: it made one */
    int iterations;                                            /* refinement steps that were drawn */
    double loss, render_start, map_start, render_end, map_end; /* of R_0 and R_T */
    double spread, scene; /* likelihoods of R_0's errors and of the scene (model.spread, model.scene) */
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
    double seconds;
} tr_validation;

/* Callbacks, on the calling thread; any may be NULL. note: one line. stop: asked between steps. Of several ranks, rank
 * 0 has all of them and the others stop: all ranks stop when one of them is told to. */
typedef struct tr_listener {
    void (*step)(const tr_row *row, void *user);
    void (*validated)(const tr_validation *v, void *user);
    void (*note)(const char *line, void *user);
    bool (*stop)(void *user);
    void *user;
} tr_listener;

typedef struct tr_trainer tr_trainer;

/* ranks: NULL for one process; outlives the trainer. All ranks call each function below together. Where another rank
 * has the message of a failure, this one's is empty.
 *
 * Takes the folder (which exists) for this run; another trainer in it, a checkpoint in it without resume, and one of
 * another configuration with resume are errors. In a folder without a checkpoint the run begins, with resume too; what
 * a run has left there beside weights is renamed. NULL and st set on failure. */
tr_trainer *tr_create(const tr_config *config, const char *folder, bool resume, const tr_ranks *ranks,
                      const tr_listener *listener, ts_status *st);

/* Writes the weights that a run of this configuration starts from. */
ts_code tr_initial(const tr_config *config, const char *path, ts_status *st);

/* The folder of a run without output.folder: runs/NAME for .../NAME.ini. */
void tr_default_folder(const char *config_path, char *folder, size_t size);

int64_t tr_step_now(const tr_trainer *t);

/* Writes a checkpoint before step 1, then works to the end, or to the listener's stop (TS_INTERRUPTED, with a
 * checkpoint saved), or to the first error. */
ts_code tr_run(tr_trainer *t, ts_status *st);

void tr_destroy(tr_trainer **t);
#endif
