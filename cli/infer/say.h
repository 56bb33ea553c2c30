/* What is said of a photograph on standard error. */
#ifndef CL_SAY_H
#define CL_SAY_H
#include "cli/infer/item.h"
#include "cli/infer/options.h"

/* What the sheet gave, unless quiet, and the photographs in which it was not found. False: there are such. Where
 * none has it, the first one's message is the item's. */
bool cl_say_sheet(const cl_item *item, bool quiet);

/* What was assumed, what makes it a poor one, and how near the maps come. Returns in short why its maps should be
 * looked at; NULL: they need not, or there are none. */
const char *cl_say_photo(const cl_command *c, const cl_item *item);

/* What was in its folder and is not any more. */
void cl_say_replaced(const cl_item *item);
#endif
