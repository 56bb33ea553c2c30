/* How many threads the OpenMP loops use. */
#ifndef TS_THREADS_H
#define TS_THREADS_H
#include <stdbool.h>
#include <stddef.h>

/* Process-wide. n >= 1: use n threads; 0: as many as the process may use (affinity mask and cgroup CPU quota). */
void ts_threads_set(int n);
int ts_threads_allowed(void); /* what 0 stands for */

int ts_threads(void);
/* Of a loop that is given a number: n, or the process's where n is 0. */
static inline int ts_threads_of(int n) { return n > 0 ? n : ts_threads(); }

/* Binds each of the threads in use to a CPU of its own, in the order of the process's affinity mask, so that times do
 * not depend on where the system moves them. False, with nothing changed, when there are fewer CPUs than threads. Call
 * after ts_threads_set. */
bool ts_threads_pin(void);
#endif
