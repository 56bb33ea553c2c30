/* Whether the machine has the memory for what is about to be done: the kernel promises more than there is, and ends a
 * program that believes it. */
#ifndef LGD_MEMORY_H
#define LGD_MEMORY_H
#include "tensor/status.h"

/* TS_NOMEM, with both figures, when bytes are more than the system and the container leave. What cannot be found out is
 * no limit. */
ts_code lgd_memory_check(double bytes, ts_status *st);
#endif
