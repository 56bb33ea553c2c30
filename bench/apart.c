#include "bench/apart.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include "tensor/wait.h"
#include <stdatomic.h>
#include <stdbool.h>

enum { TIMES = 4000 };
#define PATIENCE 0.1 /* seconds, in which a thread that shares its CPU has had its turn */

typedef struct game {
    _Alignas(64) atomic_int ball; /* odd on its way there, even on its way back */
    long long begin, end;
} game;

/* False when it takes too long. */
static bool wait_for(atomic_int *ball, int value, long long until)
{
    for (int looks = 0; atomic_load(ball) < value; looks++)
        if (looks % 1024 == 1023 && nanoseconds() > until) return false;
    return true;
}

static void play(const void *games, int thread)
{
    game *g = *(game *const *)games;
    const long long until = nanoseconds() + (long long)(PATIENCE * 1e9);
    if (thread > 1) return;
    for (int i = 0; i < TIMES; i++) {
        if (thread == 1) {
            if (!wait_for(&g->ball, 2 * i + 1, until)) return;
            atomic_store(&g->ball, 2 * i + 2);
            continue;
        }
        if (i == TIMES / 2) g->begin = nanoseconds(); /* both have come */
        atomic_store(&g->ball, 2 * i + 1);
        if (!wait_for(&g->ball, 2 * i + 2, until)) return;
    }
    if (thread == 0) g->end = nanoseconds();
}

double bench_apart(void)
{
    game g = {.end = 0}, *now = &g;
    if (ts_threads() < 2) return 0;
    ts_each_thread(2, play, &now);
    return g.end ? 1e-9 * (double)(g.end - g.begin) / (TIMES - TIMES / 2) : 0;
}
