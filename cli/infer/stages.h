/* The way of a photograph: read, estimated, written. Each stage sets the item's st on failure. */
#ifndef LGD_STAGES_H
#define LGD_STAGES_H
#include "cli/infer/item.h"
#include "cli/infer/options.h"

/* Called while an item is estimated, with the part that is done; nonzero: stop. */
typedef int (*lgd_item_progress)(lgd_item *item, double done, void *user);

/* published: as infer/photograph.h says. recipe: lgd_recipe's. */
void lgd_item_read(const lgd_command *c, const char *recipe, bool published, lgd_item *item);
void lgd_item_estimate(const lgd_command *c, lgd_model *model, lgd_item *item, lgd_item_progress progress, void *user);
double lgd_item_bytes(const lgd_command *c, const lgd_model *model); /* that an estimate takes, at most */
void lgd_item_write(const lgd_command *c, const char *recipe, lgd_item *item);
#endif
