#include "data/loader.h"
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>

/* Threads take one material at a time, in order; batch b lives in slot b % slots. One slot more than depth: the one
 * that the caller reads. */
struct io_loader {
    io_procedural procedural;
    int size, slots, threads;
    io_share share;
    int batch;      /* materials of it that are made here */
    uint64_t first; /* the number of the first batch */
    uint64_t taken; /* materials that threads have begun, from the first batch on */
    uint64_t given; /* batches that the caller has asked for */
    int *done;      /* per slot: finished materials */
    float *maps;    /* [slots][batch][size][size][9] */
    bool stop;
    ts_status error;
    pthread_t *thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
};

static bool all_finite(const float *v, size_t count)
{
    float sum = 0; /* 0 * x is 0 for every finite x and NaN otherwise */
    for (size_t i = 0; i < count; i++) sum += 0 * v[i];
    return sum == 0;
}

static void *work(void *argument)
{
    io_loader *l = argument;
    size_t values = (size_t)l->size * (size_t)l->size * MAP_CHANNELS;
    pthread_mutex_lock(&l->lock);
    while (!l->stop) {
        uint64_t task = l->taken, batch = task / (uint64_t)l->batch;
        /* The caller holds batch given - 1, so the slots are free for given - 1 .. given - 2 + slots. */
        if (batch + 1 >= l->given + (uint64_t)l->slots + (l->given == 0)) {
            pthread_cond_wait(&l->changed, &l->lock);
            continue;
        }
        l->taken++;
        size_t slot = (size_t)(batch % (uint64_t)l->slots), item = (size_t)(task % (uint64_t)l->batch);
        uint64_t index = (l->first + batch) * (uint64_t)l->share.batch + (uint64_t)l->share.from + item;
        pthread_mutex_unlock(&l->lock);
        io_material m = {.size = l->size, .maps = l->maps + (slot * (size_t)l->batch + item) * values};
        io_procedural_make(&l->procedural, index, &m);
        bool good = all_finite(m.maps, values);
        pthread_mutex_lock(&l->lock);
        if (!good) {
            ts_fail(
                &l->error, TS_NUMERIC,
                "procedural material %s (seed %llu) has a value that is not finite; leave its family out and report it",
                m.name, (unsigned long long)l->procedural.seed);
            l->stop = true;
        }
        if (++l->done[slot] == l->batch || !good) pthread_cond_broadcast(&l->changed);
    }
    pthread_mutex_unlock(&l->lock);
    return NULL;
}

io_loader *io_loader_create(const io_procedural *p, int size, io_share share, uint64_t first, int depth, int threads,
                            ts_status *st)
{
    const int batch = share.count;
    if (share.from < 0 || batch < 1 || share.from > share.batch - batch) {
        ts_fail(st, TS_INVALID, "loader: materials %d to %d are not of a batch of %d", share.from,
                share.from + batch - 1, share.batch);
        return NULL;
    }
    if (size < 1 || size > 16384 || depth < 1 || depth > 1024 || threads < 1 || threads > 1024) {
        ts_fail(st, TS_INVALID, "loader: size %d, depth %d and threads %d must be at least 1", size, depth, threads);
        return NULL;
    }
    io_loader *l = calloc(1, sizeof *l);
    if (!l) {
        ts_fail(st, TS_NOMEM, "loader: out of memory");
        return NULL;
    }
    l->procedural = *p;
    l->size = size;
    l->share = share;
    l->batch = batch;
    l->slots = depth + 1;
    l->first = first;
    pthread_mutex_init(&l->lock, NULL);
    pthread_cond_init(&l->changed, NULL);
    size_t bytes = (size_t)size * (size_t)size * MAP_CHANNELS * sizeof(float), items = (size_t)l->slots * (size_t)batch;
    l->done = calloc((size_t)l->slots, sizeof *l->done);
    l->thread = calloc((size_t)threads, sizeof *l->thread);
    l->maps = items <= PTRDIFF_MAX / bytes ? malloc(items * bytes) : NULL;
    if (!l->done || !l->thread || !l->maps) {
        ts_fail(st, TS_NOMEM, "loader: no memory for %zu materials of %d x %d (lower the batch or the size)", items,
                size, size);
        io_loader_destroy(&l);
        return NULL;
    }
    for (; l->threads < threads; l->threads++)
        if (pthread_create(&l->thread[l->threads], NULL, work, l)) {
            ts_fail(st, TS_NOMEM, "loader: the system refused thread %d of %d (use fewer)", l->threads + 1, threads);
            io_loader_destroy(&l);
            return NULL;
        }
    return l;
}

const float *io_loader_next(io_loader *l, ts_status *st)
{
    pthread_mutex_lock(&l->lock);
    if (l->given > 0) l->done[(l->given - 1) % (uint64_t)l->slots] = 0;
    size_t slot = (size_t)(l->given++ % (uint64_t)l->slots);
    pthread_cond_broadcast(&l->changed);
    while (l->done[slot] < l->batch && l->error.code == TS_OK) pthread_cond_wait(&l->changed, &l->lock);
    bool good = l->error.code == TS_OK;
    if (!good && st) *st = l->error;
    pthread_mutex_unlock(&l->lock);
    return good ? l->maps + slot * (size_t)l->batch * (size_t)l->size * (size_t)l->size * MAP_CHANNELS : NULL;
}

void io_loader_destroy(io_loader **loader)
{
    io_loader *l = *loader;
    if (!l) return;
    pthread_mutex_lock(&l->lock);
    l->stop = true;
    pthread_cond_broadcast(&l->changed);
    pthread_mutex_unlock(&l->lock);
    for (int i = 0; i < l->threads; i++) pthread_join(l->thread[i], NULL);
    pthread_mutex_destroy(&l->lock);
    pthread_cond_destroy(&l->changed);
    free(l->done);
    free(l->thread);
    free(l->maps);
    free(l);
    *loader = NULL;
}
