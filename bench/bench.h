/* The bench's interface. A file bench/bench_NAME.c holds BENCH(name) { … } blocks, run in order of name by
 * build/bin/lgd-bench. */
#ifndef BENCH_H
#define BENCH_H
#include <stdbool.h>

typedef void (*bench_function)(void);
void bench_register(const char *name, bench_function f);
#define BENCH(name)                                                                                         \
    static void bench_##name(void);                                                                         \
    __attribute__((constructor)) static void register_##name(void) { bench_register(#name, bench_##name); } \
    static void bench_##name(void)

/* Median seconds of one call of f(user), after a warm-up, for about a third of a second in all. The FMA peak is
 * measured before and after, so that a row's fraction refers to the machine's speed at that moment. The
 * convolutions' inner loop is measured too: it needs nearly all of a core's issue slots, the FMA peak half of them, so
 * that another program on the same core (simultaneous multithreading) slows only the first. */
typedef struct bench_time {
    double seconds; /* median of one call */
    double best;    /* the shortest: without disturbance by other programs */
    double peak;    /* FLOP/s of the FMA peak with the threads in use, the mean of before and after */
    double loop; /* FLOP/s of the convolutions' inner loop on data in the first cache, the median of before, between and
                    after; 0: does not apply */
    double apart; /* bench_apart, the larger of before and after */
    int runs;
} bench_time;
bench_time bench_measure(void (*f)(void *user), void *user);

/* Sets the time's peak to that of bf16 (matrix unit or vdpbf16ps), measured now. False, with nothing changed, when the
 * instruction set in use has none. */
bool bench_bf16(bench_time *t);

/* Times are processor time (lgd-bench --cpu). */
bool bench_cpu(void);

/* A row: label, milliseconds, GFLOP/s and the fraction of the peak, at the median and at the best, and of the inner
 * loop (flop = 0: no such columns); whether the threads were on CPUs that share no cache. */
void bench_row(const char *label, bench_time t, double flop);
/* A row: the time of a call alone, and how many times as long it takes beside as many busy processes as there are
 * threads, and twice as many, on the same CPUs; measured in turn. */
void bench_load(const char *label, void (*f)(void *user), void *user);
/* A row with a figure in another unit, for example 150.2 "Mpixel/s". */
void bench_row_unit(const char *label, bench_time t, double value, const char *unit);
void bench_heading(const char *text);
/* A row: how many times as fast as one thread all of them are, median of five measured in turn, and the same of the FMA
 * peak. Wall time only. */
void bench_row_threads(void (*f)(void *user), void *user);

void bench_sort(double *v, int count);     /* ascending */
double bench_median(double *v, int count); /* which it sorts */
double bench_wall(void);                   /* seconds of a clock that only goes on */

/* Below a row: its floor (flop at the peak), and what the peers take for the same work (bench/peer_torch.py, whose head
 * lists the jobs; "bf16 " before one that has its networks in bf16, so that bf16 is held against bf16). One that is not
 * there is named once, one that has not this work each time. */
void bench_row_peers(bench_time t, double flop, const char *job);
#endif
