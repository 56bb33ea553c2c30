/* Loops on several threads. The calling thread works on its loop itself; beside it do workers, which all callers of the
 * process share and which are started when a loop first asks for them. A loop is cut into ranges that threads come for:
 * one that the system gives no time to holds nobody up but for the range that it has begun, and one that comes late
 * finds the work done. Threads that wait spin for some microseconds and then sleep.
 *
 * Who works on which range is not known, so results must not depend on it. Loops inside of the ranges of a loop that
 * several threads share are run by the thread that meets them. Any number of threads may call at once. After a fork the
 * child begins with no workers. A worker that the system refuses is done without, since its ranges are for anybody: the
 * loop is slower, not wrong; it is asked for again a second later, and a program can be notified. */
#ifndef TS_TEAM_H
#define TS_TEAM_H
#include <stdbool.h>
#include <stdint.h>

/* Calls run(job, begin, end) for ranges that together are [0, count), each value once, on up to so many threads (0: the
 * process's number). Ranges begin at multiples of step >= 1. Neighbouring ranges are one thread's as far as time
 * allows, and those of the next loop with as many values are the same thread's: its cache has them. */
void ts_for(int threads, int64_t count, int64_t step, void (*run)(const void *job, int64_t begin, int64_t end),
            const void *job);

/* Calls run(job, i) for i = 0 .. count-1 on up to so many threads; they are begun in this order. */
void ts_tasks(int threads, int64_t count, void (*run)(const void *job, int64_t i), const void *job);

/* The same in no order: as of ts_for's ranges, neighbours are one thread's as far as time allows, and those of the next
 * loop with as many values, or twice as many, are the same thread's. Tasks that are numbered as the rows of an image
 * are then run where what they read was written: CPUs that do not share a cache fetch each other's values slowly. */
void ts_spread_tasks(int threads, int64_t count, void (*run)(const void *job, int64_t i), const void *job);

/* Both for threads with something of their own to prepare: each that takes part calls run(job, queue) once, which asks
 * for its tasks, piece >= 1 neighbours at a time, with ts_next until that is false. */
typedef struct ts_queue ts_queue;
typedef enum ts_order { TS_IN_ORDER, TS_SPREAD } ts_order;
void ts_share_tasks(int threads, ts_order order, int64_t count, int64_t piece,
                    void (*run)(const void *job, ts_queue *queue), const void *job);
bool ts_next(ts_queue *queue, int64_t *begin, int64_t *end);

/* handler is called the first time that the system refuses a worker, by the thread that wanted it: it goes on with so
 * many threads in place of those that were wanted. NULL, as it begins: no call. Set before the first loop. */
void ts_team_refused(void (*handler)(int threads, int wanted));

/* Calls run(job, k) with k = 0 .. n-1 on n threads, each once and all at the same time; the caller's k is 0. n is
 * threads (0: the process's number), less where the system refuses workers, 1 inside of a loop. Returns n. */
int ts_each_thread(int threads, void (*run)(const void *job, int k), const void *job);
#endif
