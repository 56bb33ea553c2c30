/* A training run in a folder: steps, validation, checkpoints and the log. Everything random is a function of (seed,
 * step), so that a resumed run makes the same bytes as one that was not interrupted, for any number of threads.
 *
 * Two phases. The first, pretrain_steps long, trains g alone on R_0's loss; the second trains g and h on R_T's and
 * R_0's. Each has its own warm-up, cosine and Adam moments, since the two losses differ.
 *
 * Several ranks (train/ranks.h) make one run: train.batch is the batch of all, of which each makes its share, the same
 * materials for any number of ranks; gradients are summed, and all ranks have one update. Rank 0 alone has the
 * folder. The same number of ranks makes the same bytes; another one the same numbers to rounding.
 *
 * The folder's files: config.ini (as it runs), log.csv (a row a step), val.csv (a row a validation), best.safetensors
 * (weights with the least validated error in the phase), last.safetensors (weights at the last checkpoint after
 * step 1), checkpoint.safetensors (what --resume reads; there before step 1), curve.svg (the logs drawn), lock. */
#ifndef TR_TRAINER_H
#define TR_TRAINER_H
#include "train/config.h"
#include "train/listener.h"
#include "train/ranks.h"

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
