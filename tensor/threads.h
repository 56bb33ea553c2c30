/* How many threads loops use (tensor/team.h). */
#ifndef TS_THREADS_H
#define TS_THREADS_H
#include "tensor/status.h"
#include <stdbool.h>

/* Process-wide. n >= 1: use n threads, whatever the environment says; 0: OMP_NUM_THREADS, or where that is not set as
 * many as the process may use (affinity mask and cgroup CPU quota), and no more than OMP_THREAD_LIMIT. */
void ts_threads_set(int n);
int ts_threads_allowed(void); /* what 0 stands for */
/* The same for one of so many processes >= 1 that compute together on a machine: its part of the CPUs, and of the
 * cgroup's quota, which is of all of them. */
int ts_threads_of_share(int cpus, int processes);
/* TS_INVALID where one of the two variables is set and no number of threads; it is then as if it were not. */
ts_code ts_threads_check(ts_status *st);

int ts_threads(void);
/* Of a loop that is given a number: n, or the process's where n is 0. */
static inline int ts_threads_of(int n) { return n > 0 ? n : ts_threads(); }

#endif
