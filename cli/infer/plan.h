/* What goes where, settled before any work: each photograph's output folder, and that nothing overwrites anything. */
#ifndef CL_PLAN_H
#define CL_PLAN_H
#include "tensor/status.h"

typedef struct cl_job {
    const char *photo; /* the caller's */
    char *stem;        /* the file's name without its extension, or a folder's name */
    char *folder;      /* DIR/STEM */
} cl_job;

typedef struct cl_plan {
    cl_job *job;
    int jobs;
} cl_plan;

/* Rules: STEM is the file's name up to its last dot, or a folder's whole name, of a file capture.ini that of the folder
 * that it lies in; a name that would leave an empty stem, "." or ".." is used whole, and refused when it is one of
 * these itself. A photograph that is given twice counts once. Two with the same stem are refused, both named; so is a
 * photograph that one of the outputs would replace. TS_INVALID. The caller frees the plan after success. */
ts_code cl_plan_make(char *const *photos, int count, const char *out, cl_plan *plan, ts_status *st);

/* Moves each photograph that is the same file as one before it behind the others, which keep their order. Returns how
 * many these are. */
int cl_plan_distinct(char **photo, int count);

/* TS_INVALID where one of the plan's outputs would replace one of these files, each a `what`. */
ts_code cl_plan_check(const cl_plan *plan, const char *what, const char *const *file, int files, ts_status *st);

/* Leaves the jobs of part shard, 1 .. shards, in their order. The STEM alone decides, whatever other photographs there
 * are. */
void cl_plan_keep(cl_plan *plan, int shard, int shards);
void cl_plan_free(cl_plan *plan);
#endif
