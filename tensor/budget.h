/* How much memory one piece of work may take. The kernel promises more than there is, and ends a program that believes
 * it: what a file's header asks for is counted and refused before it is taken. */
#ifndef TS_BUDGET_H
#define TS_BUDGET_H
#include "tensor/status.h"

/* The limit in bytes, of the process. 0: the default, three quarters of what the machine has or its control groups
 * allow, whichever is less. */
void ts_budget_set(double bytes);

/* What may be taken now: the limit, or less where the system and the control groups have less to give without pushing
 * others out. What cannot be found out is no limit: INFINITY. */
double ts_budget_left(void);

/* TS_NOMEM, with both figures, when bytes are more than that. */
ts_code ts_budget_check(double bytes, ts_status *st);
#endif
