#include "tensor/team.h"
#include "tensor/begin.h"
#include "tensor/threads.h"
#include "tensor/wait.h"
#include <limits.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

enum {
    SLOTS = 64,     /* loops at once; more than that are their callers' alone */
    WORKERS = 1023, /* the programs take up to 1024 threads */
    SHARES = 64,    /* of a loop's values, each its threads' own as long as it lasts */
    PIECES = 8      /* of a share, so that it can be helped with */
};
#define AGAIN 1.0 /* seconds until a worker that was refused is asked for again */

typedef struct share {
    _Alignas(64) atomic_llong next;
    int64_t end;
} share;

typedef struct loop {
    void (*run)(const void *job, ts_queue *queue);
    const void *job;
    int64_t piece;
    int shares;
    share share[SHARES];
} loop;

struct ts_queue {
    loop *loop;
    int share, left; /* where this thread is, and how many shares it has not seen to their end */
};

/* A loop that workers may join. state: PLACE for each that still may, 1 for each that has and is not done, ASLEEP while
 * the caller sleeps until those are. What a slot points to belongs to its caller and is read between joining and
 * leaving alone. */
enum { PLACE = 1 << 12, INSIDE = PLACE - 1, PLACES = 0x7ffff000 };
#define ASLEEP 0x80000000u
typedef struct slot {
    _Alignas(64) atomic_uint state;
    atomic_bool taken;
    loop *loop;
} slot;

enum { IDLE, BUSY, SLEEPING };
typedef struct worker {
    _Alignas(64) atomic_uint state;
} worker;

static slot slots[SLOTS];
static worker workers[WORKERS];
static atomic_int slots_used, size; /* the first so many of them */
static atomic_uint posted;          /* loops so far, which workers watch */
static atomic_llong refused_until;  /* nanoseconds */
static pthread_mutex_t growing = PTHREAD_MUTEX_INITIALIZER, each_alone = PTHREAD_MUTEX_INITIALIZER;
static _Thread_local bool inside; /* of a loop */
static void (*on_refusal)(int threads, int wanted);

bool ts_next(ts_queue *q, int64_t *begin, int64_t *end)
{
    for (; q->left > 0; q->left--, q->share = (q->share + 1) % q->loop->shares) {
        share *s = &q->loop->share[q->share];
        if (atomic_load_explicit(&s->next, memory_order_relaxed) >= s->end) continue;
        *begin = atomic_fetch_add_explicit(&s->next, q->loop->piece, memory_order_relaxed);
        if (*begin >= s->end) continue;
        *end = s->end - *begin < q->loop->piece ? s->end : *begin + q->loop->piece;
        return true;
    }
    return false;
}

static void take_part(loop *l, int index) { l->run(l->job, &(ts_queue){l, index % l->shares, l->shares}); }

static bool join(slot *s)
{
    unsigned now = atomic_load_explicit(&s->state, memory_order_relaxed);
    while (now & PLACES)
        if (atomic_compare_exchange_weak_explicit(&s->state, &now, now - PLACE + 1, memory_order_acquire,
                                                  memory_order_relaxed))
            return true;
    return false;
}

static void leave(slot *s)
{
    const unsigned before = atomic_fetch_sub_explicit(&s->state, 1, memory_order_release);
    if (before & ASLEEP && (before & INSIDE) == 1) futex_wake(&s->state);
}

/* All loops that have a place, once. Whether there was one. */
static bool serve(worker *w)
{
    const int used = atomic_load(&slots_used);
    bool served = false;
    for (int i = 0; i < used; i++) {
        if (!join(&slots[i])) continue;
        atomic_store_explicit(&w->state, BUSY, memory_order_relaxed);
        take_part(slots[i].loop, (int)(w - workers) + 1);
        atomic_store_explicit(&w->state, IDLE, memory_order_relaxed); /* before its caller can go on and count */
        leave(&slots[i]);
        served = true;
    }
    return served;
}

static void *work(void *user)
{
    worker *w = user;
    inside = true;
    for (;;) {
        const unsigned seen = atomic_load(&posted);
        if (serve(w) || spin(&posted, UINT_MAX, seen, false)) continue;
        /* A caller counts its loop first and looks for sleepers then; here it is the other way round. */
        atomic_store(&w->state, SLEEPING);
        if (atomic_load(&posted) != seen) atomic_store(&w->state, IDLE);
        while (atomic_load(&w->state) == SLEEPING) futex_wait(&w->state, SLEEPING);
    }
    return NULL;
}

void ts_team_refused(void (*handler)(int threads, int wanted)) { on_refusal = handler; }

static void before_fork(void) { pthread_mutex_lock(&growing); }

static void after_fork(void) { pthread_mutex_unlock(&growing); }

static void in_child(void)
{
    for (int i = 0; i < atomic_load(&slots_used); i++) {
        atomic_store(&slots[i].state, 0);
        atomic_store(&slots[i].taken, false);
    }
    for (int i = 0; i < atomic_load(&size); i++) atomic_store(&workers[i].state, IDLE);
    atomic_store(&size, 0);
    pthread_mutex_init(&growing, NULL);
    pthread_mutex_init(&each_alone, NULL);
}

/* Signals from outside are for the program's own threads. Those that a thread brings upon itself, by a fault or by what
 * it writes, act on a worker as on any thread: were they blocked there, a file that is too large would end the process
 * or not, depending on which thread writes it. */
static void block_signals(sigset_t *before)
{
    static const int own[] = {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGPIPE, SIGSEGV, SIGSYS, SIGTRAP, SIGXFSZ};
    sigset_t others;
    sigfillset(&others);
    for (size_t i = 0; i < sizeof own / sizeof *own; i++) sigdelset(&others, own[i]);
    pthread_sigmask(SIG_SETMASK, &others, before);
}

/* So many workers, or as many as the system grants. */
static void grow(int wanted)
{
    static bool watched, once;
    static atomic_bool told;
    sigset_t before;
    pthread_attr_t attr;
    if (atomic_load(&refused_until) > nanoseconds() || pthread_attr_init(&attr)) return;
    pthread_attr_setdetachstate(&attr, PTHREAD_CREATE_DETACHED);
    pthread_mutex_lock(&growing);
    if (!once) watched = pthread_atfork(before_fork, after_fork, in_child) == 0;
    once = true;
    block_signals(&before);
    for (int i; watched && (i = atomic_load(&size)) < wanted; atomic_store(&size, i + 1)) {
        pthread_t thread;
        if (ts_begin_thread(&thread, &attr, work, &workers[i]) == 0) continue;
        atomic_store(&refused_until, nanoseconds() + (long long)(AGAIN * 1e9));
        break;
    }
    const int there = atomic_load(&size);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_mutex_unlock(&growing);
    pthread_attr_destroy(&attr);
    if (there < wanted && on_refusal && !atomic_exchange(&told, true)) on_refusal(there + 1, wanted + 1);
}

/* Sees to it that so many workers look at what is posted, as far as there are such that are not busy. */
static void call_workers(int wanted)
{
    const int there = atomic_load(&size);
    int found = 0;
    for (int i = 0; i < there && found < wanted; i++) {
        unsigned state = atomic_load(&workers[i].state);
        if (state == BUSY) continue;
        if (state == SLEEPING && atomic_compare_exchange_strong(&workers[i].state, &state, IDLE))
            futex_wake(&workers[i].state);
        found++;
    }
    /* Several callers share what the machine has; one may ask for more. */
    static atomic_int allowed;
    if (found == wanted) return;
    if (!atomic_load(&allowed)) atomic_store(&allowed, ts_threads_allowed());
    int most = atomic_load(&allowed) - 1;
    if (most < wanted) most = wanted;
    if (most > WORKERS) most = WORKERS;
    if (there < most) grow(there + wanted - found < most ? there + wanted - found : most);
}

static slot *take_slot(void)
{
    for (int i = 0; i < SLOTS; i++) {
        if (atomic_load_explicit(&slots[i].taken, memory_order_relaxed) ||
            atomic_exchange_explicit(&slots[i].taken, true, memory_order_acquire))
            continue;
        int used = atomic_load(&slots_used);
        while (used <= i && !atomic_compare_exchange_weak(&slots_used, &used, i + 1)) continue;
        return &slots[i];
    }
    return NULL;
}

static void post(slot *s, loop *l, int others)
{
    s->loop = l;
    atomic_store_explicit(&s->state, (unsigned)others * PLACE, memory_order_release);
    atomic_fetch_add(&posted, 1);
    call_workers(others);
}

/* Nobody may join any more; waits for those that have. */
static void finish(slot *s)
{
    atomic_fetch_and(&s->state, (unsigned)INSIDE);
    if (!spin(&s->state, INSIDE, 0, true)) {
        unsigned now = atomic_fetch_or(&s->state, ASLEEP) | ASLEEP;
        for (; now & INSIDE; now = atomic_load(&s->state)) futex_wait(&s->state, now);
        atomic_store_explicit(&s->state, 0, memory_order_relaxed);
    }
    atomic_store_explicit(&s->taken, false, memory_order_release);
}

static void run_loop(int threads, loop *l)
{
    slot *s = threads > 1 && !inside ? take_slot() : NULL;
    if (s) {
        post(s, l, threads - 1);
        inside = true;
    }
    take_part(l, 0);
    if (s) {
        inside = false;
        finish(s);
    }
}

static int limited(int threads, int64_t pieces)
{
    int n = ts_threads_of(threads);
    if (n > WORKERS + 1) n = WORKERS + 1;
    return n < pieces ? n : (int)pieces;
}

typedef struct ranges {
    void (*run)(const void *job, int64_t begin, int64_t end);
    const void *job;
} ranges;

static void run_ranges(const void *job, ts_queue *queue)
{
    const ranges *r = job;
    for (int64_t begin, end; ts_next(queue, &begin, &end);) r->run(r->job, begin, end);
}

/* Cuts [0, count) into shares of whole steps, which threads take piece by piece. */
static void spread(loop *l, int64_t count, int64_t step, int64_t piece, int shares)
{
    const int64_t steps = count / step + (count % step != 0);
    l->piece = piece;
    l->shares = shares;
    for (int i = 0; i < shares; i++) {
        const int64_t end = steps * (i + 1) / shares * step;
        atomic_init(&l->share[i].next, steps * i / shares * step);
        l->share[i].end = end < count ? end : count;
    }
}

static int shares_of(int threads) { return threads < SHARES ? threads : SHARES; }

void ts_for(int threads, int64_t count, int64_t step, void (*run)(const void *job, int64_t begin, int64_t end),
            const void *job)
{
    const int64_t steps = count / step + (count % step != 0);
    const int n = inside ? 1 : limited(threads, steps);
    if (count < 1) return;
    if (n == 1) {
        run(job, 0, count);
        return;
    }
    const int shares = shares_of(n);
    const int64_t each = (steps + shares - 1) / shares;
    loop l;
    l.run = run_ranges;
    l.job = &(ranges){run, job};
    spread(&l, count, step, (each + PIECES - 1) / PIECES * step, shares);
    run_loop(n, &l);
}

void ts_share_tasks(int threads, ts_order order, int64_t count, int64_t piece,
                    void (*run)(const void *job, ts_queue *queue), const void *job)
{
    if (count < 1) return;
    const int n = limited(threads, (count + piece - 1) / piece);
    loop l;
    l.run = run;
    l.job = job;
    spread(&l, count, piece, piece, order == TS_IN_ORDER || inside ? 1 : shares_of(n));
    run_loop(n, &l);
}

typedef struct tasks {
    void (*run)(const void *job, int64_t i);
    const void *job;
} tasks;

static void run_tasks(const void *job, ts_queue *queue)
{
    const tasks *t = job;
    for (int64_t i, end; ts_next(queue, &i, &end);) t->run(t->job, i);
}

void ts_tasks(int threads, int64_t count, void (*run)(const void *job, int64_t i), const void *job)
{
    ts_share_tasks(threads, TS_IN_ORDER, count, 1, run_tasks, &(tasks){run, job});
}

void ts_spread_tasks(int threads, int64_t count, void (*run)(const void *job, int64_t i), const void *job)
{
    ts_share_tasks(threads, TS_SPREAD, count, 1, run_tasks, &(tasks){run, job});
}

typedef struct roll {
    void (*run)(const void *job, int k);
    const void *job;
    int count;
    atomic_int *there;
} roll;

static void answer(const void *job, ts_queue *queue)
{
    (void)queue;
    const roll *r = job;
    const int k = atomic_fetch_add(r->there, 1);
    while (atomic_load(r->there) < r->count) sched_yield(); /* all are needed, and none may come twice */
    r->run(r->job, k);
}

int ts_each_thread(int threads, void (*run)(const void *job, int k), const void *job)
{
    int n = inside ? 1 : limited(threads, WORKERS + 1);
    slot *s = NULL;
    if (n > 1) {
        pthread_mutex_lock(&each_alone); /* two that wait for each other's workers would do so for ever */
        if (atomic_load(&size) < n - 1) grow(n - 1);
        if (n > atomic_load(&size) + 1) n = atomic_load(&size) + 1;
        if (n > 1) s = take_slot();
        if (!s) {
            pthread_mutex_unlock(&each_alone);
            n = 1;
        }
    }
    atomic_int there;
    atomic_init(&there, 1);
    const roll r = {run, job, n, &there};
    loop l;
    l.run = answer;
    l.job = &r;
    l.shares = 1;
    const bool before = inside;
    if (s) post(s, &l, n - 1);
    inside = true;
    while (atomic_load(&there) < n) sched_yield();
    run(job, 0);
    inside = before;
    if (s) {
        finish(s);
        pthread_mutex_unlock(&each_alone);
    }
    return n;
}
