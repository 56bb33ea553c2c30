/* Scratch memory of each thread. */
#ifndef TS_SCRATCH_H
#define TS_SCRATCH_H
#include <stddef.h>

/* At least bytes of 64-byte aligned memory that belong to the calling thread and slot (0 .. TS_SCRATCH_SLOTS-1) until
 * the next call with that slot on that thread. Grows only, never shrinks, so a repeated workload stops allocating.
 * Never NULL: when memory is out it calls what ts_scratch_fails was given, since no kernel can go on. */
enum { TS_SCRATCH_SLOTS = 4 };
void *ts_scratch(int slot, size_t bytes);

/* handler is called by any thread with the bytes that cannot be had, and must end the process. Without one: abort. */
void ts_scratch_fails(void (*handler)(size_t bytes));

/* Between steps, while no scratch is in use: each of so many threads (0: the process's number) grows its slots to the
 * largest size that any thread has asked for. Under a dynamic schedule a thread may meet its largest task late; after
 * this it finds the memory there. */
void ts_scratch_level(int threads);
#endif
