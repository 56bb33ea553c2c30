/* Threads that stay on a CPU. */
#include "tensor/pin.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <sched.h>

static void look(const void *job, int k)
{
    cpu_set_t *const *of = job;
    sched_getaffinity(0, sizeof **of, &(*of)[k]);
}

TEST(threads_are_pinned_to_a_cpu_each)
{
    cpu_set_t all, now;
    CHECK(sched_getaffinity(0, sizeof all, &all) == 0, "sched_getaffinity");
    ts_threads_set(CPU_COUNT(&all) + 1);
    CHECK(!ts_threads_pin() && sched_getaffinity(0, sizeof now, &now) == 0 && CPU_EQUAL(&all, &now),
          "more threads than CPUs are pinned");
    const int threads = CPU_COUNT(&all) > 1 ? 2 : 1;
    ts_threads_set(threads);
    CHECK(ts_threads_pin(), "%d threads are not pinned", threads);
    cpu_set_t of[2];
    CHECK(ts_each_thread(threads, look, &(cpu_set_t *){of}) == threads, "not %d threads", threads);
    for (int i = 0; i < threads; i++) CHECK(CPU_COUNT(&of[i]) == 1, "thread %d has %d CPUs", i, CPU_COUNT(&of[i]));
    CHECK(threads == 1 || !CPU_EQUAL(&of[0], &of[1]), "two threads share a CPU");
}
