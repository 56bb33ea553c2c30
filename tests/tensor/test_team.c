/* The loops of tensor/team.h: every value once, whoever comes; several callers; forks; workers that are refused. */
#include "tensor/team.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* The linker puts it in pthread_create's place. */
static atomic_bool refuse;
int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *user);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *user);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *user)
{
    return atomic_load(&refuse) ? EAGAIN : __real_pthread_create(thread, attr, run, user);
}

typedef struct marks {
    int64_t count, step;
    atomic_int *mark, *bad;
} marks;

static void mark_range(const void *job, int64_t begin, int64_t end)
{
    const marks *m = job;
    if (begin % m->step || end <= begin || end > m->count || (end % m->step && end != m->count))
        atomic_fetch_add(m->bad, 1);
    for (int64_t i = begin; i < end && i < m->count; i++) atomic_fetch_add(&m->mark[i], 1);
}

static void mark_one(const void *job, int64_t i) { mark_range(job, i, i + 1); }

static void mark_pieces(const void *job, ts_queue *queue)
{
    for (int64_t begin, end; ts_next(queue, &begin, &end);) mark_range(job, begin, end);
}

/* Of some loops of each kind how many values were not met once, and ranges not as they should be. */
static int wrong(int threads, int64_t count, int64_t step)
{
    int missed = 0;
    atomic_int bad = 0, *mark = calloc((size_t)count + 1, sizeof *mark);
    if (!mark) return -1;
    ts_for(threads, count, step, mark_range, &(marks){count, step, mark, &bad});
    ts_tasks(threads, count, mark_one, &(marks){count, 1, mark, &bad});
    ts_spread_tasks(threads, count, mark_one, &(marks){count, 1, mark, &bad});
    ts_share_tasks(threads, TS_IN_ORDER, count, step, mark_pieces, &(marks){count, step, mark, &bad});
    ts_share_tasks(threads, TS_SPREAD, count, step, mark_pieces, &(marks){count, step, mark, &bad});
    for (int64_t i = 0; i <= count; i++) missed += mark[i] != (i < count ? 5 : 0);
    free(mark);
    return missed + bad;
}

static int wrong_of_many(void)
{
    static const int64_t counts[] = {0, 1, 2, 3, 7, 64, 65, 1000, 4097}, steps[] = {1, 2, 5, 64, 10000};
    static const int threads[] = {1, 2, 3, 5, 8, 70};
    int sum = 0;
    for (int t = 0; t < 6; t++)
        for (int c = 0; c < 9; c++)
            for (int s = 0; s < 5; s++) sum += wrong(threads[t], counts[c], steps[s]) != 0;
    return sum;
}

TEST(team_meets_every_value_once)
{
    CHECK(wrong_of_many() == 0, "values are left out or met twice, or ranges begin between two steps");
}

typedef struct order {
    atomic_int next;
    atomic_int *before;
} order;

static void begin_task(const void *job, int64_t i)
{
    order *const *o = job;
    (*o)->before[i] = atomic_fetch_add(&(*o)->next, 1);
}

/* With two threads a task may begin one place early, since its number is taken before it begins. */
TEST(team_begins_tasks_in_order)
{
    enum { COUNT = 500 };
    atomic_int before[COUNT];
    order o = {.before = before}, *job = &o;
    ts_tasks(1, COUNT, begin_task, &job);
    for (int i = 0; i < COUNT; i++) CHECK(before[i] == i, "task %d of one thread is the %dth", i, before[i]);
}

static void look(const void *job, int64_t i)
{
    (void)i;
    const pthread_t *outer = ((const void *const *)job)[0];
    atomic_int *others = ((void *const *)job)[1];
    if (!pthread_equal(*outer, pthread_self())) atomic_fetch_add(others, 1);
}

static void loop_inside(const void *job, int64_t i)
{
    (void)i;
    pthread_t self = pthread_self();
    atomic_int *const *others = job;
    ts_tasks(4, 50, look, (const void *[]){&self, *others});
}

TEST(team_runs_loops_inside_of_loops_where_they_are)
{
    atomic_int others = 0, *job = &others;
    ts_tasks(4, 50, loop_inside, &job);
    CHECK(others == 0, "%d ranges of an inner loop are run by other threads", others);
}

static void *call(void *user)
{
    atomic_int *bad = user;
    for (int i = 0; i < 300; i++) atomic_fetch_add(bad, wrong(2 + i % 3, 100 + i, 1 + i % 7) != 0);
    return NULL;
}

TEST(team_serves_many_callers_at_once)
{
    enum { CALLERS = 70 }; /* more than have loops at once */
    pthread_t thread[CALLERS];
    atomic_int bad = 0;
    for (int i = 0; i < CALLERS; i++) CHECK(!pthread_create(&thread[i], NULL, call, &bad), "no thread");
    for (int i = 0; i < CALLERS; i++) pthread_join(thread[i], NULL);
    CHECK(bad == 0, "%d loops are wrong", bad);
}

static void count_thread(const void *job, int k)
{
    atomic_int *const *seen = job;
    atomic_fetch_add(&(*seen)[k], 1);
}

/* Whether each of so many threads has been there once. */
static bool all_there(int threads)
{
    atomic_int seen[8] = {0}, *job = seen;
    if (ts_each_thread(threads, count_thread, &job) != threads) return false;
    for (int i = 0; i < 8; i++)
        if (seen[i] != (i < threads)) return false;
    return true;
}

TEST(team_has_each_thread_once)
{
    for (int i = 0; i < 200; i++) CHECK(all_there(1 + i % 6), "not every one of %d threads, once", 1 + i % 6);
}

static void look_at_signals(const void *job, int k)
{
    atomic_int *const *blocked = job;
    sigset_t set;
    if (k == 0 || pthread_sigmask(SIG_BLOCK, NULL, &set)) return;
    if (sigismember(&set, SIGTERM) == 1) atomic_fetch_add(&(*blocked)[0], 1);
    if (sigismember(&set, SIGXFSZ) == 1 || sigismember(&set, SIGPIPE) == 1) atomic_fetch_add(&(*blocked)[1], 1);
}

TEST(team_workers_take_the_signals_of_what_they_do)
{
    atomic_int blocked[2] = {0}, *job = blocked;
    CHECK(ts_each_thread(3, look_at_signals, &job) == 3, "three threads");
    CHECK(blocked[0] == 2, "SIGTERM may go to a worker");
    CHECK(blocked[1] == 0, "%d workers do not see SIGXFSZ or SIGPIPE", blocked[1]);
}

TEST(team_survives_a_fork)
{
    CHECK(wrong(3, 1000, 1) == 0, "before");
    const pid_t child = fork();
    if (child == 0) _exit(wrong_of_many() == 0 && all_there(3) ? 0 : 1);
    int status;
    CHECK(child > 0 && wrong(3, 1000, 1) == 0, "the parent's loops");
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0, "the child's loops");
}

TEST(team_does_without_workers_that_are_refused)
{
    atomic_store(&refuse, true);
    CHECK(wrong_of_many() == 0, "values are left out when there are no workers");
    atomic_int seen[8] = {0}, *job = seen;
    CHECK(ts_each_thread(3, count_thread, &job) == 1 && seen[0] == 1, "threads where none can be had");
    atomic_store(&refuse, false);
    bool again = false;
    for (int i = 0; i < 400 && !again; i++) {
        nanosleep(&(struct timespec){.tv_nsec = 25000000}, NULL);
        again = all_there(3);
    }
    CHECK(again, "workers are not asked for again");
}
