/* A training step and an estimate on a machine that does other things too: alone, beside as many busy processes as
 * there are threads, and beside twice as many, on the same CPUs. In turn, so that what else changes meets all three. */
#include "bench/bench.h"
#include "infer/lgd.h"
#include "infer/model_path.h"
#include "tensor/threads.h"
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { ROUNDS = 7, CASES = 3, MOST_BUSY = 64 };
#define SHARE 0.4 /* seconds of a case without others; with them, so many times as long as CPUs are shared */

/* Of one call, the mean over so much time. */
static double mean(void (*f)(void *user), void *user, double time)
{
    const double begin = bench_wall();
    double now = begin;
    int runs = 0;
    for (; now < begin + time || runs < 3; runs++) {
        f(user);
        now = bench_wall();
    }
    return (now - begin) / runs;
}

static pid_t start_busy(void)
{
    const pid_t child = fork();
    if (child != 0) return child;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    raise(SIGSTOP);
    for (volatile unsigned i = 0;; i++) continue;
}

void bench_load(const char *label, void (*f)(void *user), void *user)
{
    const int threads = ts_threads(), most = 2 * threads < MOST_BUSY ? 2 * threads : MOST_BUSY;
    pid_t busy[MOST_BUSY];
    int there = 0;
    double time[CASES][ROUNDS], worst = 0;
    f(user);
    while (there < most && (busy[there] = start_busy()) > 0) there++;
    for (int i = 0; i < there; i++) waitpid(busy[i], NULL, WUNTRACED);
    for (int round = 0; round < ROUNDS && there == most; round++)
        for (int c = 0; c < CASES; c++) {
            const int count = c * most / (CASES - 1);
            for (int i = 0; i < count; i++) kill(busy[i], SIGCONT);
            time[c][round] = mean(f, user, SHARE * (c + 1));
            for (int i = 0; i < count; i++) kill(busy[i], SIGSTOP);
        }
    for (int i = 0; i < there; i++) kill(busy[i], SIGKILL), waitpid(busy[i], NULL, 0);
    if (there < most) {
        printf("  %s: no process can be started beside it\n", label);
        return;
    }
    for (int c = CASES - 1; c >= 0; c--) {
        for (int round = 0; round < ROUNDS && c > 0; round++)
            if (c == CASES - 1 && time[c][round] > worst) worst = time[c][round];
        for (int round = 0; round < ROUNDS && c > 0; round++) time[c][round] /= time[0][round];
        bench_sort(time[c], ROUNDS);
    }
    printf("  %-48s %9.2f ms alone; %d busy processes beside it: %.2f times, %d: %.2f times (worst round %.0f ms)\n",
           label, 1e3 * time[0][ROUNDS / 2], most / 2, time[1][ROUNDS / 2], most, time[2][ROUNDS / 2], 1e3 * worst);
    fflush(stdout);
}

enum { SIDE = 256, CHANNELS = 9 };

typedef struct call {
    lgd_model *model;
    float *image, *maps;
} call;

static void estimate(void *user)
{
    const call *c = user;
    const lgd_options o = lgd_options_default();
    lgd_error e;
    if (lgd_estimate(c->model, c->image, SIDE, &o, c->maps, &e)) abort();
}

BENCH(load_estimate)
{
    char path[PATH_MAX];
    ts_status st = {0};
    lgd_error e = {0};
    const size_t pixels = (size_t)SIDE * SIDE;
    call c = {.image = malloc(pixels * 3 * sizeof(float)), .maps = malloc(pixels * CHANNELS * sizeof(float))};
    bench_heading("an estimate on a machine that does other things too");
    if (!c.image || !c.maps || lgd_model_path(NULL, LGD_DEFAULT_MODEL, path, &st) || !(c.model = lgd_load(path, &e)))
        printf("  not measured: %s\n", st.code ? st.message : e.message);
    else {
        for (size_t i = 0; i < pixels * 3; i++) c.image[i] = (float)(i % 97) / 97;
        bench_load("the shipped model, 256 x 256", estimate, &c);
    }
    lgd_free(&c.model);
    free(c.image);
    free(c.maps);
}
