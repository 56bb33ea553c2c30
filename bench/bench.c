/* lgd-bench [--cpu] [NAME...]: runs the benchmarks whose name contains one of the words (all without a word), in order
 * of name. */
#include "bench/bench.h"
#include "bench/apart.h"
#include "bench/batches.h"
#include "cli/cli.h"
#include "tensor/cpu.h"
#include "tensor/kernels/conv.h"
#include "tensor/kernels/peak.h"
#include "tensor/peak.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST = 256, MOST_RUNS = 1000 };
#define LOOP_EVERY 0.02 /* seconds */
#define APART 200e-9    /* seconds: bench_apart of CPUs that share a cache is less */
static struct entry {
    const char *name;
    bench_function f;
} list[MOST];
static int entries;

void bench_register(const char *name, bench_function f)
{
    if (entries == MOST) {
        fprintf(stderr, "lgd-bench: more than %d benchmarks: raise MOST in bench/bench.c\n", MOST);
        exit(1);
    }
    list[entries++] = (struct entry){name, f};
}

static bool processor_time;

bool bench_cpu(void) { return processor_time; }

/* Wall time; or the processor time of all threads over their number, which does not see what other programs take on a
 * busy machine (nor threads that wait for each other). */
static double read_clock(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double bench_wall(void) { return read_clock(CLOCK_MONOTONIC); }

static double now(void) { return processor_time ? read_clock(CLOCK_PROCESS_CPUTIME_ID) / ts_threads() : bench_wall(); }

static double peak(void) { return ts_peak_of(ts_peak_k()->run, now); }

enum { MOST_THREADS = 1024 };

/* The largest tile over and over, of as few k as a part of a sum has channels. Each thread's own speed: convolutions
 * deal out their work as threads come for it. */
static void run_inner_loop(const void *speeds, int thread)
{
    enum { DEPTH = 96, TIMES = 400 };
    static _Alignas(64) float input[TS_TILE_PIXELS * DEPTH],
        weights[DEPTH * 2 * 16]; /* zeros; no vector has more than 16 lanes */
    const struct ts_conv_kernels *k = ts_conv_k();
    const ts_segment segment = {0, 0, DEPTH};
    float out[TS_TILE_PIXELS * 2 * 16];
    ts_tile t = {.segment = &segment,
                 .segments = 1,
                 .a_stride = DEPTH,
                 .y_stride = 2 * k->lanes,
                 .w = weights,
                 .leak = 1,
                 .channels = 2 * k->lanes,
                 .fetch = {weights, weights}};
    for (int i = 0; i < 3; i++) {
        const int pixel = i * TS_TILE_GROUP < k->pixels ? i * TS_TILE_GROUP : 0;
        t.a[i] = input + pixel * t.a_stride;
        t.y[i] = out + pixel * t.y_stride;
    }
    double *const *speed = speeds;
    const double begin = now();
    for (int i = 0; i < TIMES; i++) k->tile[1][k->pixels](&t);
    if (thread < MOST_THREADS) (*speed)[thread] = 2.0 * TIMES * DEPTH * k->pixels * 2 * k->lanes / (now() - begin);
}

static double inner_loop(void)
{
    static double of[MOST_THREADS];
    double *speed = of, sum = 0;
    const int threads = ts_each_thread(0, run_inner_loop, &speed);
    for (int i = 0; i < threads; i++) sum += of[i];
    return sum;
}

bool bench_bf16(bench_time *t)
{
    if (!ts_peak_k()->run_bf16) return false;
    t->peak = ts_peak_of(ts_peak_k()->run_bf16, now);
    t->loop = 0;
    return true;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void bench_sort(double *v, int count) { qsort(v, (size_t)count, sizeof *v, by_value); }

double bench_median(double *v, int count)
{
    bench_sort(v, count);
    return count % 2 ? v[count / 2] : 0.5 * (v[count / 2 - 1] + v[count / 2]);
}

bench_time bench_measure(void (*f)(void *user), void *user)
{
    static double times[MOST_RUNS], loops[MOST_RUNS];
    bench_time t = {.peak = peak(), .apart = bench_apart()};
    int looped = 0;
    f(user);
    const double begin = now();
    double last = begin - LOOP_EVERY;
    do {
        if (now() - last >= LOOP_EVERY) {
            loops[looped++] = inner_loop();
            last = now();
        }
        const double start = now();
        f(user);
        times[t.runs++] = now() - start;
    } while (t.runs < MOST_RUNS && (t.runs < 3 || now() - begin < 0.33));
    if (looped < MOST_RUNS) loops[looped++] = inner_loop();
    const double apart = bench_apart();
    if (apart > t.apart) t.apart = apart;
    t.peak = 0.5 * (t.peak + peak());
    t.loop = bench_median(loops, looped);
    t.seconds = bench_median(times, t.runs);
    t.best = times[0];
    return t;
}

void bench_row_threads(void (*f)(void *user), void *user)
{
    enum { ROUNDS = 5 };
    const int all = ts_threads();
    double gain[ROUNDS], of_peak[ROUNDS];
    if (all == 1 || processor_time) return;
    for (int i = 0; i < ROUNDS; i++) {
        ts_threads_set(1);
        const bench_time one = bench_measure(f, user);
        ts_threads_set(all);
        const bench_time many = bench_measure(f, user);
        gain[i] = one.seconds / many.seconds;
        of_peak[i] = many.peak / one.peak;
    }
    printf("    %d threads: %.2f times as fast as one, the peak %.2f times\n", all, bench_median(gain, ROUNDS),
           bench_median(of_peak, ROUNDS));
    fflush(stdout);
}

void bench_heading(const char *text) { printf("\n%s\n", text); }

void bench_row(const char *label, bench_time t, double flop)
{
    printf("  %-56s %11.4f ms", label, 1e3 * t.seconds);
    if (flop > 0)
        printf(" %9.1f GFLOP/s %6.1f %% of the peak (best %.1f)", 1e-9 * flop / t.seconds,
               100 * flop / t.seconds / t.peak, 100 * flop / t.best / t.peak);
    if (flop > 0 && t.loop > 0) printf(", %.1f %% of the inner loop", 100 * flop / t.seconds / t.loop);
    if (t.apart > APART) printf(", on CPUs that share no cache (%.0f ns there and back)", 1e9 * t.apart);
    printf("\n");
    fflush(stdout);
}

void bench_row_unit(const char *label, bench_time t, double value, const char *unit)
{
    printf("  %-56s %11.4f ms %9.4g %s\n", label, 1e3 * t.seconds, value, unit);
    fflush(stdout);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct entry *)a)->name, ((const struct entry *)b)->name);
}

int main(int argc, char **argv)
{
    cl_open_streams();
    cl_trace();
    ts_status st = {0};
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        printf("usage: lgd-bench [--list | --cpu | --batches CONFIG.ini] [NAME...]\nRuns the benchmarks whose name "
               "contains one of the words; all of them without a word. --cpu: processor\n"
               "time over the number of threads in place of wall time, for a machine that others use too."
               "\n--batches writes what lgd-train would train with to standard output "
               "(bench/batches.h).\n");
        return 0;
    }
    qsort(list, (size_t)entries, sizeof *list, by_name);
    if (argc > 1 && strcmp(argv[1], "--cpu") == 0) {
        processor_time = true;
        argc--;
        argv++;
    }
    if (argc == 3 && strcmp(argv[1], "--batches") == 0) {
        if (ts_isa_init(&st) != TS_OK || bench_batches(argv[2], &st) != TS_OK)
            fprintf(stderr, "lgd-bench: %s\n", st.message);
        return st.code ? 1 : 0;
    }
    if (argc == 2 && strcmp(argv[1], "--list") == 0) {
        for (int i = 0; i < entries; i++) printf("%s\n", list[i].name);
        return 0;
    }
    if (ts_isa_init(&st) != TS_OK) {
        fprintf(stderr, "lgd-bench: %s\n", st.message);
        return 1;
    }
    printf("%s, %d threads, FMA peak %.1f GFLOP/s%s\n", ts_isa_name(ts_isa_now()), ts_threads(), 1e-9 * peak(),
           processor_time ? ", processor time" : "");
    int ran = 0;
    for (int i = 0; i < entries; i++) {
        bool wanted = argc == 1;
        for (int a = 1; a < argc; a++)
            if (strstr(list[i].name, argv[a])) wanted = true;
        if (!wanted) continue;
        list[i].f();
        ran++;
    }
    if (ran == 0) {
        fprintf(stderr, "lgd-bench: no benchmark has such a name; --list names them\n");
        return 2;
    }
    return 0;
}
