/* What goes where, settled before any work: each photograph's output folder, and that nothing overwrites anything. */
#ifndef LGD_PLAN_H
#define LGD_PLAN_H
#include "tensor/status.h"

typedef struct lgd_job {
    const char *photo; /* the caller's */
    char *stem;        /* the file name without its extension */
    char *folder;      /* DIR/STEM */
} lgd_job;

typedef struct lgd_plan {
    lgd_job *job;
    int jobs;
} lgd_plan;

/* Rules: STEM is the file's name up to its last dot; a name that would leave an empty stem, "." or ".." is used whole,
 * and refused when it is one of these itself. Two photographs with the same stem are refused, both named; so is a
 * photograph that one of the outputs would replace. TS_INVALID. The caller frees the plan after success. */
ts_code lgd_plan_make(char *const *photos, int count, const char *out, lgd_plan *plan, ts_status *st);

/* Leaves the jobs of part shard, 1 .. shards, in their order. The STEM alone decides, whatever other photographs there
 * are. */
void lgd_plan_keep(lgd_plan *plan, int shard, int shards);
void lgd_plan_free(lgd_plan *plan);
#endif
