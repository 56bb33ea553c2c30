#include "tensor/pin.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <sched.h>
#include <stdatomic.h>

typedef struct pinning {
    const cpu_set_t *all;
    atomic_int *bound;
} pinning;

static void pin(const void *job, int k)
{
    const pinning *p = job;
    cpu_set_t one;
    int cpu = 0;
    while (!CPU_ISSET(cpu, p->all) || k-- > 0) cpu++;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    if (sched_setaffinity(0, sizeof one, &one) == 0) atomic_fetch_add(p->bound, 1); /* of the calling thread alone */
}

bool ts_threads_pin(void)
{
    cpu_set_t all;
    const int threads = ts_threads();
    if (sched_getaffinity(0, sizeof all, &all) != 0 || CPU_COUNT(&all) < threads) return false;
    atomic_int bound = 0;
    ts_each_thread(threads, pin, &(pinning){&all, &bound});
    return bound == threads;
}
