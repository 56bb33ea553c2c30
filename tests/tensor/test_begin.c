/* Threads that begin where their creator is not. */
#include "tensor/begin.h"
#include "tests/test.h"
#include <sched.h>
#include <stdatomic.h>

typedef struct seen {
    int cpu;
    cpu_set_t may;
} seen;

static void *look(void *user)
{
    seen *s = user;
    s->cpu = sched_getcpu();
    sched_getaffinity(0, sizeof s->may, &s->may);
    return user;
}

static seen begin_one(void)
{
    seen s = {.cpu = -1};
    pthread_t thread;
    void *back = NULL;
    CHECK(ts_begin_thread(&thread, NULL, look, &s) == 0 && pthread_join(thread, &back) == 0, "no thread");
    CHECK(back == &s, "its result is lost");
    return s;
}

TEST(threads_begin_elsewhere)
{
    enum { ROUNDS = 50 };
    cpu_set_t all;
    int elsewhere = 0;
    CHECK(sched_getaffinity(0, sizeof all, &all) == 0, "sched_getaffinity");
    for (int i = 0; i < ROUNDS; i++) {
        const int here = sched_getcpu();
        const seen s = begin_one();
        CHECK(CPU_EQUAL(&s.may, &all), "a thread may use %d of %d CPUs", CPU_COUNT(&s.may), CPU_COUNT(&all));
        elsewhere += s.cpu != here;
    }
    /* Either may be moved meanwhile. */
    CHECK(CPU_COUNT(&all) == 1 || elsewhere > ROUNDS / 2, "%d of %d threads began elsewhere", elsewhere, ROUNDS);
}

TEST(threads_begin_where_there_is_one_cpu)
{
    cpu_set_t one;
    const int here = sched_getcpu();
    CPU_ZERO(&one);
    CPU_SET(here, &one);
    CHECK(here >= 0 && sched_setaffinity(0, sizeof one, &one) == 0, "sched_setaffinity");
    const seen s = begin_one();
    CHECK(s.cpu == here && CPU_EQUAL(&s.may, &one), "the thread is on CPU %d, not %d", s.cpu, here);
}

static void *look_at_itself(void *user)
{
    atomic_int *state = user;
    pthread_attr_t attr;
    int detached = -1;
    if (pthread_getattr_np(pthread_self(), &attr) == 0) {
        pthread_attr_getdetachstate(&attr, &detached);
        pthread_attr_destroy(&attr);
    }
    atomic_store(state, detached);
    return NULL;
}

TEST(threads_begin_detached)
{
    static atomic_int state; /* the thread may outlive this function */
    pthread_attr_t attr;
    pthread_t thread;
    atomic_store(&state, -2);
    CHECK(pthread_attr_init(&attr) == 0 && pthread_attr_setdetachstate(&attr, PTHREAD_CREATE_DETACHED) == 0, "attr");
    CHECK(ts_begin_thread(&thread, &attr, look_at_itself, &state) == 0, "no thread");
    pthread_attr_destroy(&attr);
    while (atomic_load(&state) == -2) sched_yield();
    CHECK(atomic_load(&state) == PTHREAD_CREATE_DETACHED, "the thread is not detached");
}
