/* What training in several processes asks of MPI. Two shared objects offer it, one built with Open MPI and one with
 * MPICH, since the two libraries have different binary interfaces; train/ranks.c loads the one whose launcher started
 * the process. Nothing else knows MPI, and no program is linked with it.
 *
 * Ranks are the processes 0 .. count - 1. All of them call the functions in the same order; an error of MPI's own ends
 * the job with MPI's message. One thread of a process calls them. */
#ifndef TR_MPI_H
#define TR_MPI_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>

typedef enum tr_reduce {
    TR_REDUCE_F32, /* MPI_Iallreduce of floats */
    TR_REDUCE_BF16 /* every rank's values are rounded to bf16, summed as floats in the order of the ranks, and the sum
                    * is rounded to bf16: half the bytes. Off by at most 2^-8 of the sum of the values' magnitudes,
                    * and 2^-8 of the sum, for any number of ranks */
} tr_reduce;

typedef struct tr_world {
    int rank, count;
    int cpus;        /* this rank's share of the CPUs that it may run on with others */
    int local;       /* ranks on its host, this one too */
    int local_rank;  /* its number among them */
    char where[480]; /* for a message: ranks, host and PIDs of each host, as many as fit */
} tr_world;

typedef struct tr_mpi {
    const char *build; /* TR_MPI_BUILD; another one has other functions */
    ts_code (*start)(tr_world *world, ts_status *st);
    void (*finish)(void);
    void (*abort)(int status); /* ends the processes of all ranks at once */
    /* Whether all ranks call it within so many seconds of each other, whatever else they have begun. */
    bool (*all_here)(double seconds);
    void (*broadcast)(void *data, size_t bytes); /* rank 0's, to all */
    int (*least)(int value);                     /* of the ranks' */
    void (*sum)(double *values, int count);      /* over the ranks, in place; all get the same bytes */
    /* The same without waiting: values is read now, and holds the sums after complete. */
    ts_code (*begin_sum)(double *values, int count, ts_status *st);
    ts_code (*begin_gradient)(float *values, size_t count, tr_reduce how, ts_status *st);
    /* Memory that the ranks of a host share, where each host has as many of them and more than one. All ranks call it,
     * once. common: so many floats, one block for all of a host's ranks. gradient: so many zeros, this rank's own. From
     * then on begin_gradient of what lies there makes the sums of this rank's part alone (tr_part of what is begun);
     * the others' parts are zeros when sum_here returns. NULL, or why it cannot be had: no rank has it then. */
    const char *(*share)(size_t common_count, size_t gradient_count, float **common, float **gradient);
    /* The sum over the ranks of this host that share memory, in their order, when all have called it; what they have
     * written before is seen by all. meet: the same without a sum. */
    double (*sum_here)(double value);
    void (*meet)(void);
    void (*poke)(void);     /* lets what was begun go on: MPI does so only while it is called */
    void (*complete)(void); /* waits for all that was begun */
} tr_mpi;

#define TR_MPI_BUILD LGD_VERSION " 3"
#define TR_MPI_TABLE "tr_mpi_table"
#endif
