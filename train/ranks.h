/* Training in several processes that mpirun (or srun) has started: rank 0 .. count - 1, each with its share of every
 * batch. MPI is loaded only then (train/mpi/mpi.h). */
#ifndef TR_RANKS_H
#define TR_RANKS_H
#include "train/mpi/mpi.h"
#include <stdint.h>

typedef struct tr_ranks {
    int rank, count;   /* 0 and 1 without a launcher */
    const tr_mpi *mpi; /* NULL: one process, nothing to agree on */
    tr_world world;
} tr_ranks;

/* What the launcher's environment says, without MPI. */
bool tr_launched(void);       /* as one of several processes */
int tr_launched_rank(void);   /* 0 otherwise */
bool tr_launched_first(void); /* on its host; true otherwise */

/* Loads and starts MPI where the process was launched as one of several; otherwise *ranks is one process. On failure
 * the launcher ends the other processes when this one ends. */
ts_code tr_ranks_start(tr_ranks *ranks, ts_status *st);

/* Ends MPI in an orderly way where all ranks get here within seconds of each other; a rank that failed alone ends the
 * others with it. status: what the program is about to exit with. */
void tr_ranks_end(tr_ranks *ranks, int status);

/* What rank has of total things 0 .. total - 1: from *from on, returned is how many. Shares differ by one at most. */
int tr_share(const tr_ranks *ranks, int total, int *from);

/* Every rank says whether it failed: the first that did, -1 where none. */
int tr_first_failed(const tr_ranks *ranks, bool failed);

/* The same for a function's end: code where it is an error; otherwise TS_OK, or TS_INVALID without a message where
 * another rank failed, which says why. */
ts_code tr_agree(const tr_ranks *ranks, ts_code code, ts_status *st);

/* Fails on every rank whose bytes are not rank 0's; what: for the message. All ranks return at once. */
ts_code tr_same_bytes(const tr_ranks *ranks, const void *data, size_t bytes, const char *what, ts_status *st);
#endif
