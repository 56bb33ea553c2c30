/* train/mpi/mpi.h with the MPI library that this is compiled with. */
#include "train/mpi/mpi.h"
#include "train/mpi/parts.h"
#include "train/mpi/place.h"
#include "train/mpi/rounded.h"
#include <limits.h>
#include <mpi.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

/* One sum that was begun. Slots are used in order and kept, so that from the second step on nothing is allocated. */
typedef struct slot {
    MPI_Request request;
    size_t capacity; /* bytes of each buffer */
    void *from, *to;
    float *values; /* rounded or shared: where the sums go */
    size_t count;
    enum { DONE, SUMMING, SCATTERING, GATHERING, MEETING } state;
} slot;

/* Of a communicator, ranks must begin collectives in one order. Those that begin when another one ends have their own,
 * so that their order among the rest says nothing, and so has the meeting of those who leave. */
static MPI_Comm sums, gathers, leaving;
/* The ranks of this host, and those of all hosts that have the same number there. */
static MPI_Comm host, peers;
static int rank, ranks, local, local_rank, hosts; /* hosts: 0 where they have different numbers of ranks */
static slot *slots;
static int used, capacity, first; /* slots before first are done */

/* What the ranks of this host share: each one's gradient, and a number of each. */
static struct {
    MPI_Win window;
    float **gradient; /* [local]; NULL: nothing is shared */
    size_t count;
    double *number; /* [local] */
} shared;

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
static int cpus_of_rank(void)
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

/* Where each host has as many ranks. */
static int hosts_of(int each)
{
    int range[] = {each, -each};
    MPI_Allreduce(MPI_IN_PLACE, range, 2, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    return range[0] == -range[1] ? ranks / each : 0;
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
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &host);
    MPI_Comm_size(host, &local);
    MPI_Comm_rank(host, &local_rank);
    MPI_Comm_split(MPI_COMM_WORLD, local_rank, rank, &peers);
    hosts = hosts_of(local);
    w->cpus = cpus_of_rank();
    w->local = local;
    w->local_rank = local_rank;
    tr_place mine = {.pid = getpid()}, *all = malloc((size_t)ranks * sizeof *all);
    if (!all) return ts_fail(st, TS_NOMEM, "no memory for the names of %d ranks", ranks);
    gethostname(mine.host, sizeof mine.host - 1);
    MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all, sizeof mine, MPI_BYTE, MPI_COMM_WORLD);
    tr_places_say(all, ranks, w->where, sizeof w->where);
    free(all);
    return TS_OK;
}

static void finish(void)
{
    for (int i = 0; first == used && i < capacity; i++) { /* those of sums that a failed step has left are MPI's */
        free(slots[i].from);
        free(slots[i].to);
    }
    if (first == used) free(slots);
    slots = NULL;
    capacity = used = first = 0;
    if (shared.gradient) {
        MPI_Win_unlock_all(shared.window);
        MPI_Win_free(&shared.window);
        free(shared.gradient);
        shared.gradient = NULL;
    }
    MPI_Comm_free(&host);
    MPI_Comm_free(&peers);
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

/* Whether the system has so many bytes of memory for what processes share: beyond them a write ends the process. */
static bool has_room(size_t bytes)
{
    struct statvfs f;
    const int fits = statvfs("/dev/shm", &f) != 0 || (double)f.f_bavail * (double)f.f_frsize > (double)bytes;
    return least(fits) == 1;
}

static const char *share(size_t common_count, size_t gradient_count, float **common, float **gradient)
{
    enum { LINE = 64 };
    const size_t numbers = ((size_t)local * sizeof(double) + LINE - 1) / LINE * LINE,
                 all = numbers + common_count * sizeof(float), own = gradient_count * sizeof(float) + LINE;
    void *base;
    MPI_Aint size;
    int unit;
    if (local < 2 || !hosts) return hosts ? "hosts have one rank each" : "hosts have different numbers of ranks";
    if (!has_room(all + LINE + (size_t)local * own)) return "/dev/shm has too little room";
    float **of = malloc((size_t)local * sizeof *of);
    if (least(of != NULL) == 0) {
        free(of);
        return "there is no memory";
    }
    MPI_Info info;
    MPI_Info_create(&info);
    MPI_Info_set(info, "alloc_shared_noncontig", "true"); /* each rank's near its processor */
    MPI_Win_allocate_shared((MPI_Aint)(own + (local_rank ? 0 : all)), 1, info, host, &base, &shared.window);
    MPI_Info_free(&info);
    MPI_Win_lock_all(MPI_MODE_NOCHECK, shared.window);
    for (int r = 0; r < local; r++) { /* pages begin at the same place in every process, and so do lines */
        MPI_Win_shared_query(shared.window, r, &size, &unit, &base);
        char *line = (char *)base + (LINE - (uintptr_t)base % LINE) % LINE;
        if (r == 0) {
            shared.number = (double *)(void *)line;
            *common = (float *)(void *)(line + numbers);
        }
        of[r] = (float *)(void *)(line + (r ? 0 : all));
    }
    shared.gradient = of;
    shared.count = gradient_count;
    *gradient = of[local_rank];
    memset(*gradient, 0, gradient_count * sizeof **gradient);
    return NULL;
}

static void meet(void)
{
    MPI_Request r;
    MPI_Win_sync(shared.window);
    MPI_Ibarrier(host, &r);
    await(&r);
    MPI_Win_sync(shared.window);
}

static double sum_here(double value)
{
    double sum = 0;
    shared.number[local_rank] = value;
    meet();
    for (int r = 0; r < local; r++) sum += shared.number[r];
    return sum;
}

static bool is_shared(const float *values)
{
    return shared.gradient && values >= shared.gradient[local_rank] &&
        values < shared.gradient[local_rank] + shared.count;
}

/* All ranks of this host have the bucket: this one adds up its part, and the hosts what each has. */
static void add_up(slot *s)
{
    const size_t from = tr_part(s->count, local, local_rank), count = tr_part(s->count, local, local_rank + 1) - from;
    float *own = shared.gradient[local_rank], *part = s->values + from;
    MPI_Win_sync(shared.window);
    tr_add_parts(shared.gradient, local, (size_t)(part - own), count, own);
    s->state = DONE;
    if (hosts < 2) return;
    memcpy(s->from, part, count * sizeof *part);
    s->state = SUMMING;
    MPI_Iallreduce(s->from, part, (int)count, MPI_FLOAT, MPI_SUM, peers, &s->request);
}

static ts_code begin_gradient(float *values, size_t count, tr_reduce how, ts_status *st)
{
    const bool rounded = how == TR_REDUCE_BF16;
    if (count > INT_MAX - (size_t)ranks)
        return ts_fail(st, TS_UNSUPPORTED, "a sum of %zu values is more than MPI counts", count);
    if (is_shared(values)) {
        slot *s = next_slot(hosts < 2 ? 1 : tr_part(count, local, 1) * sizeof *values, st);
        if (!s) return st->code;
        s->values = values;
        s->count = count;
        s->state = MEETING;
        MPI_Win_sync(shared.window);
        MPI_Ibarrier(host, &s->request);
        return TS_OK;
    }
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
    bool second = true; /* all sums before this one have begun the second of their collectives */
    for (int i = first; i < used; i++) {
        slot *s = &slots[i];
        const bool begins = s->state == SCATTERING || s->state == MEETING;
        int done = 0;
        if (s->state == DONE || (begins && !second)) continue;
        MPI_Test(&s->request, &done, MPI_STATUS_IGNORE);
        if (!done) second = second && !begins;
        else if (s->state == SCATTERING) gather(s);
        else if (s->state == MEETING) add_up(s);
        else {
            if (s->state == GATHERING) tr_unround(s->to, s->count, s->values);
            s->state = DONE;
        }
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
                                                                    .share = share,
                                                                    .sum_here = sum_here,
                                                                    .meet = meet,
                                                                    .poke = poke,
                                                                    .complete = complete};
