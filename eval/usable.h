/* What is asked of sets that have nothing of the kind. */
#ifndef EV_USABLE_H
#define EV_USABLE_H
#include "eval/command.h"
#include "eval/methods/method.h"
#include "eval/sets.h"

/* Of c->sets open sets. TS_INVALID for an option that none of them uses; TS_IO where the folder of --peer-maps cannot
 * be read, or has maps of none of the photographs. */
ts_code ev_usable_options(const ev_command *c, const ev_set *set, ts_status *st);

/* TS_INVALID for a method that scores a peer's maps where no set has any, or is to read more photographs than a set has
 * of each material, and for --iterations where no method has them. */
ts_code ev_usable_methods(const ev_command *c, const ev_estimator *method, int methods, const ev_set *set,
                          ts_status *st);
#endif
