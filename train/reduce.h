/* Gradients summed over the ranks while backward still makes others: a bucket is a run of parameters of the model's
 * block, sent off when all of them are complete. Buckets are sent from the block's end to its beginning, the order in
 * which backward finishes most of them, and the same on every rank. */
#ifndef TR_REDUCE_H
#define TR_REDUCE_H
#include "nn/model.h"
#include "train/mpi/mpi.h"

typedef struct tr_bucket {
    size_t first, last; /* floats of the block */
    int missing;        /* parameters that are not complete */
} tr_bucket;

typedef struct tr_reducer {
    const tr_mpi *mpi;
    nn_model *model;
    size_t bytes; /* a bucket is closed when it has as many */
    tr_reduce how;
    tr_bucket *bucket; /* [model->params] */
    int *bucket_of;    /* [model->params], -1: fixed */
    int count, sent;
    int parts, part;  /* of every bucket this rank sums one part alone (tr_mpi.share); 0: it has all sums */
    ts_status status; /* the first error; all of them are this process's alone */
} tr_reducer;

/* model stays the caller's. NOMEM with st on failure; free in any case. */
ts_code tr_reducer_create(tr_reducer *r, const tr_mpi *mpi, nn_model *model, size_t bytes, tr_reduce how,
                          ts_status *st);
void tr_reducer_free(tr_reducer *r);

/* Before a backward: nothing is complete. Parameters of a fixed part are left out. */
void tr_reduce_begin(tr_reducer *r);
/* For ag_watch, user: the reducer. */
void tr_reduce_walked(float *const *grad, int count, void *user);
/* After backward, or without one: sends what has not been sent, and waits until the model's gradients are the sums. */
ts_code tr_reduce_finish(tr_reducer *r, ts_status *st);
/* Ranges of [*first, *last) that this rank has the sums of, i from 0 on; false: there are no more. One may be empty. */
bool tr_reduce_own(const tr_reducer *r, int i, size_t *first, size_t *last);
#endif
