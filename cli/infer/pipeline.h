/* Many photographs: several at once, each estimated and written on threads of its own, while the next are read. */
#ifndef CL_PIPELINE_H
#define CL_PIPELINE_H
#include "cli/infer/stages.h"

typedef struct cl_pipeline cl_pipeline;

/* Starts reading at once, in the plan's order, published: as infer/photograph.h says; plan and command outlive the
 * pipeline. recipe: cl_recipe's where photographs may be complete already (skip_existing), or NULL. NULL with st on
 * failure. */
cl_pipeline *cl_pipeline_start(const cl_plan *plan, const cl_command *command, const char *recipe, bool published,
                               ts_status *st);

/* What the pipeline reports to. progress is called by several threads at once, each time for another item; finished for
 * every photograph in the plan's order, when its files are complete or its st says why not, by the thread that calls
 * cl_pipeline_run. stop is asked before each photograph, by any of the threads: true ends the work after what is being
 * computed and written; photographs that were read and not estimated end with TS_INTERRUPTED. */
typedef struct cl_listener {
    cl_item_progress progress;
    void (*finished)(const cl_item *item, void *user);
    bool (*stop)(void);
    void *user;
} cl_listener;

/* Estimates and writes everything. Once for a pipeline. recipe: cl_recipe's. */
void cl_pipeline_run(cl_pipeline *p, lgd_model *model, const char *recipe, const cl_listener *listener);

/* Waits for what is under way. Nulls the pointer. */
void cl_pipeline_end(cl_pipeline **p);
#endif
