/* Many photographs: several at once, each estimated and written on threads of its own, while the next are read. */
#ifndef LGD_PIPELINE_H
#define LGD_PIPELINE_H
#include "cli/infer/stages.h"

typedef struct lgd_pipeline lgd_pipeline;

/* Starts reading at once, in the plan's order, published: as infer/photograph.h says; plan and command outlive the
 * pipeline. recipe: lgd_recipe's where photographs may be complete already (skip_existing), or NULL. NULL with st on
 * failure. */
lgd_pipeline *lgd_pipeline_start(const lgd_plan *plan, const lgd_command *command, const char *recipe, bool published,
                                 ts_status *st);

/* What the pipeline reports to. progress is called by several threads at once, each time for another item; finished for
 * every photograph in the plan's order, when its files are complete or its st says why not, by the thread that calls
 * lgd_pipeline_run. stop is asked before each photograph, by any of the threads: true ends the work after what is being
 * computed and written; photographs that were read and not estimated end with TS_INTERRUPTED. */
typedef struct lgd_listener {
    lgd_item_progress progress;
    void (*finished)(const lgd_item *item, void *user);
    bool (*stop)(void);
    void *user;
} lgd_listener;

/* Estimates and writes everything. Once for a pipeline. recipe: lgd_recipe's. */
void lgd_pipeline_run(lgd_pipeline *p, lgd_model *model, const char *recipe, const lgd_listener *listener);

/* Waits for what is under way. Nulls the pointer. */
void lgd_pipeline_end(lgd_pipeline **p);
#endif
