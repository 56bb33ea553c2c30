/* Threads that stay on their CPUs, for measurements. */
#ifndef TS_PIN_H
#define TS_PIN_H
#include <stdbool.h>

/* Binds each of the threads in use to a CPU of its own, in the order of the process's affinity mask, so that times do
 * not depend on where the system moves them. False, with nothing changed, when there are fewer CPUs than threads; false
 * too where the system refuses threads or a CPU. Call after ts_threads_set. */
bool ts_threads_pin(void);
#endif
