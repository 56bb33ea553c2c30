/* The way of a photograph: read, estimated, written. Each stage sets the item's st on failure. */
#ifndef CL_STAGES_H
#define CL_STAGES_H
#include "cli/infer/item.h"
#include "cli/infer/options.h"

/* Called while an item is estimated, with the part that is done; nonzero: stop. */
typedef int (*cl_item_progress)(cl_item *item, double done, void *user);

/* published: as infer/photograph.h says. recipe: cl_recipe's. */
void cl_item_read(const cl_command *c, const char *recipe, bool published, cl_item *item);
void cl_item_estimate(const cl_command *c, lgd_model *model, cl_item *item, cl_item_progress progress, void *user);
/* Whether the model can do what the command asks for. TS_UNSUPPORTED. */
ts_code cl_command_suits(const cl_command *c, const lgd_model *model, ts_status *st);
double cl_item_bytes(const cl_command *c, const lgd_model *model); /* that an estimate takes, at most */
void cl_item_write(const cl_command *c, const char *recipe, cl_item *item);
#endif
