/* train/mpi/mpi.h with the MPI library that this is compiled with. */
#include "train/mpi/mpi.h"
#include "train/mpi/rounded.h"
#include <limits.h>
#include <mpi.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* One sum that was begun. Slots are used in order and kept, so that from the second step on nothing is allocated. */
typedef struct slot {
    MPI_Request request;
    size_t capacity; /* bytes of each buffer */
    void *from, *to;
    float *values; /* rounded: where the sums go */
    size_t count;
    enum { DONE, SUMMING, SCATTERING, GATHERING } state;
} slot;

/* Of a communicator, ranks must begin collectives in one order. Those that begin when another one ends have their own,
 * so that their order among the rest says nothing, and so has the meeting of those who leave. */
static MPI_Comm sums, gathers, leaving;
static int rank, ranks;
static slot *slots;
static int used, capacity, first; /* slots before first are done */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Between looks at a request: at first the processor is only offered to others (the loader's threads share it); what
 * takes long is not worth it. */
static void rest(double since)
{
    const struct timespec nap = {.tv_nsec = 20000};
    if (seconds() - since < 2e-4) sched_yield();
    else nanosleep(&nap, NULL);
}

static void await(MPI_Request *request)
{
    const double since = seconds();
    for (int done = 0;;) {
        MPI_Test(request, &done, MPI_STATUS_IGNORE);
        if (done) return;
        rest(since);
    }
}

static void broadcast(void *data, size_t bytes)
{
    enum { MOST = 1 << 30 }; /* MPI counts with an int */
    for (size_t at = 0; at < bytes; at += MOST) {
        MPI_Request r;
        MPI_Ibcast((char *)data + at, bytes - at < MOST ? (int)(bytes - at) : MOST, MPI_BYTE, 0, sums, &r);
        await(&r);
    }
}

static int least(int value)
{
    MPI_Request r;
    MPI_Iallreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_MIN, sums, &r);
    await(&r);
    return value;
}

static void sum(double *values, int count)
{
    MPI_Request r;
    MPI_Iallreduce(MPI_IN_PLACE, values, count, MPI_DOUBLE, MPI_SUM, sums, &r);
    await(&r);
}

/* Launchers bind ranks to CPUs of their own, or let all of a host run on all of its CPUs. */
static int cpus_of(MPI_Comm host)
{
    cpu_set_t mine, all;
    int cpus = 1, total = 0;
    CPU_ZERO(&mine);
    if (sched_getaffinity(0, sizeof mine, &mine) == 0) cpus = CPU_COUNT(&mine);
    MPI_Allreduce(&cpus, &total, 1, MPI_INT, MPI_SUM, host);
    MPI_Allreduce(&mine, &all, sizeof mine, MPI_BYTE, MPI_BOR, host);
    const int share = total > 0 ? (int)((long)cpus * CPU_COUNT(&all) / total) : 1;
    return share > 1 ? share : 1;
}

typedef struct place {
    char host[64];
    int pid;
} place;

/* "ranks 0-1 on HOST (PIDs 17 18), ..." */
static void describe(const place *p, char *text, size_t size)
{
    size_t n = 0;
    text[0] = 0;
    for (int i = 0, end; i < ranks; i = end) {
        for (end = i + 1; end < ranks && !strcmp(p[end].host, p[i].host);) end++;
        char part[160];
        int m = end - i > 1
            ? snprintf(part, sizeof part, "%sranks %d-%d on %s (PIDs", i ? ", " : "", i, end - 1, p[i].host)
            : snprintf(part, sizeof part, "%srank %d on %s (PID", i ? ", " : "", i, p[i].host);
        for (int k = i; k < end && m < (int)sizeof part - 16; k++)
            m += snprintf(part + m, sizeof part - (size_t)m, " %d", p[k].pid);
        snprintf(part + m, sizeof part - (size_t)m, ")");
        if (n + strlen(part) + 8 > size) {
            snprintf(text + n, size - n, ", ...");
            return;
        }
        n += (size_t)snprintf(text + n, size - n, "%s", part);
    }
}

static ts_code start(tr_world *w, ts_status *st)
{
    int provided, begun = 0;
    MPI_Initialized(&begun);
    if (begun) return ts_fail(st, TS_INVALID, "MPI is started already");
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided);
    if (provided < MPI_THREAD_FUNNELED)
        return ts_fail(st, TS_UNSUPPORTED, "this MPI library does not work with threads");
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    MPI_Comm_dup(MPI_COMM_WORLD, &sums);
    MPI_Comm_dup(MPI_COMM_WORLD, &gathers);
    MPI_Comm_dup(MPI_COMM_WORLD, &leaving);
    *w = (tr_world){.rank = rank, .count = ranks};
    MPI_Comm host;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &host);
    w->cpus = cpus_of(host);
    MPI_Comm_size(host, &w->local);
    MPI_Comm_free(&host);
    place mine = {.pid = getpid()}, *all = malloc((size_t)ranks * sizeof *all);
    if (!all) return ts_fail(st, TS_NOMEM, "no memory for the names of %d ranks", ranks);
    gethostname(mine.host, sizeof mine.host - 1);
    MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all, sizeof mine, MPI_BYTE, MPI_COMM_WORLD);
    describe(all, w->where, sizeof w->where);
    free(all);
    return TS_OK;
}

static void finish(void)
{
    for (int i = 0; i < capacity; i++) {
        free(slots[i].from);
        free(slots[i].to);
    }
    free(slots);
    slots = NULL;
    capacity = used = first = 0;
    MPI_Comm_free(&sums);
    MPI_Comm_free(&gathers);
    MPI_Comm_free(&leaving);
    MPI_Finalize();
}

static void end_all(int status) { MPI_Abort(MPI_COMM_WORLD, status); }

static bool all_here(double patience)
{
    const double since = seconds();
    MPI_Request r;
    MPI_Ibarrier(leaving, &r);
    for (int done = 0; seconds() - since < patience;) {
        MPI_Test(&r, &done, MPI_STATUS_IGNORE);
        if (done) return true;
        rest(since);
    }
    return false;
}

/* The next slot, with two buffers of at least so many bytes. NULL and st on failure. */
static slot *next_slot(size_t bytes, ts_status *st)
{
    if (used == capacity) {
        const int more = capacity ? 2 * capacity : 32;
        slot *grown = realloc(slots, (size_t)more * sizeof *grown);
        if (!grown) goto none;
        memset(grown + capacity, 0, (size_t)(more - capacity) * sizeof *grown);
        slots = grown;
        capacity = more;
    }
    slot *s = &slots[used];
    if (s->capacity < bytes) {
        free(s->from);
        free(s->to);
        s->capacity = 0;
        s->from = malloc(bytes);
        s->to = malloc(bytes);
        if (!s->from || !s->to) goto none;
        s->capacity = bytes;
    }
    used++;
    return s;
none:
    ts_fail(st, TS_NOMEM, "no memory for a sum of %zu bytes over the ranks", bytes);
    return NULL;
}

static ts_code begin_sum(double *values, int count, ts_status *st)
{
    slot *s = next_slot((size_t)count * sizeof *values, st);
    if (!s) return st->code;
    memcpy(s->from, values, (size_t)count * sizeof *values);
    s->state = SUMMING;
    MPI_Iallreduce(s->from, values, count, MPI_DOUBLE, MPI_SUM, sums, &s->request);
    return TS_OK;
}

/* Rounded values go to the rank that sums its part of them, and the sums to all: two collectives of the bytes that a
 * ring sends. */
static void scatter(slot *s)
{
    const size_t part = tr_rounded_part(s->count, ranks);
    tr_round(s->values, s->count, part * (size_t)ranks, s->from);
    s->state = SCATTERING;
    MPI_Ialltoall(s->from, (int)part, MPI_UINT16_T, s->to, (int)part, MPI_UINT16_T, sums, &s->request);
}

static void gather(slot *s)
{
    const size_t part = tr_rounded_part(s->count, ranks);
    tr_round_sums(s->to, ranks, part, s->from);
    s->state = GATHERING;
    MPI_Iallgather(s->from, (int)part, MPI_UINT16_T, s->to, (int)part, MPI_UINT16_T, gathers, &s->request);
}

static ts_code begin_gradient(float *values, size_t count, tr_reduce how, ts_status *st)
{
    const bool rounded = how == TR_REDUCE_BF16;
    if (count > INT_MAX - (size_t)ranks)
        return ts_fail(st, TS_UNSUPPORTED, "a sum of %zu values is more than MPI counts", count);
    const size_t bytes = rounded ? tr_rounded_part(count, ranks) * (size_t)ranks * 2 : count * sizeof *values;
    slot *s = next_slot(bytes, st);
    if (!s) return st->code;
    s->values = values;
    s->count = count;
    if (rounded) {
        scatter(s);
        return TS_OK;
    }
    /* Open MPI sums what is in place along a tree, which takes log2 N times the bytes of its other ways. */
    memcpy(s->from, values, bytes);
    s->state = SUMMING;
    MPI_Iallreduce(s->from, values, (int)count, MPI_FLOAT, MPI_SUM, sums, &s->request);
    return TS_OK;
}

static void poke(void)
{
    bool earlier_gather = true; /* all sums before this one are at least being gathered */
    for (int i = first; i < used; i++) {
        slot *s = &slots[i];
        int done = 0;
        if (s->state == SUMMING || s->state == GATHERING) MPI_Test(&s->request, &done, MPI_STATUS_IGNORE);
        else if (s->state == SCATTERING && earlier_gather) {
            MPI_Test(&s->request, &done, MPI_STATUS_IGNORE);
            if (done) gather(s);
            done = 0;
        }
        if (s->state == SCATTERING) earlier_gather = false;
        if (!done) continue;
        if (s->state == GATHERING) tr_unround(s->to, s->count, s->values);
        s->state = DONE;
    }
    while (first < used && slots[first].state == DONE) first++;
}

static void complete(void)
{
    const double since = seconds();
    for (poke(); first < used; poke()) rest(since);
    first = used = 0;
}

__attribute__((visibility("default"))) const tr_mpi tr_mpi_table = {.build = TR_MPI_BUILD,
                                                                    .start = start,
                                                                    .finish = finish,
                                                                    .abort = end_all,
                                                                    .all_here = all_here,
                                                                    .broadcast = broadcast,
                                                                    .least = least,
                                                                    .sum = sum,
                                                                    .begin_sum = begin_sum,
                                                                    .begin_gradient = begin_gradient,
                                                                    .poke = poke,
                                                                    .complete = complete};
