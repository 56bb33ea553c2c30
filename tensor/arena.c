#include "tensor/arena.h"
#include "tensor/memory.h"
#include "tensor/threads.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Chunks are whole huge pages, which tensor/memory.c asks for: a page's first touch costs two and a half times as much
 * in small ones. */
enum { ALIGN = 64, MIN_CHUNK = 4 << 20, CHUNK_STEP = 2 << 20, MAX_CHUNKS = 64 };

struct ts_arena {
    struct {
        unsigned char *base;
        size_t size;
    } chunk[MAX_CHUNKS];
    int chunks;
    size_t at, used; /* the chunk in use and the bytes taken from it */
    size_t fetched;  /* bytes of the first chunk whose pages are there, if it was reserved */
    bool reserved;
    int threads; /* that fetch them */
    size_t total, peak;
};

ts_arena *ts_arena_create(size_t initial, ts_status *st)
{
    ts_arena *a = calloc(1, sizeof *a);
    if (a && initial) {
        initial = (initial + ALIGN - 1) / ALIGN * ALIGN;
        a->chunk[0].base = ts_memory(initial);
        if (a->chunk[0].base) {
            a->chunk[0].size = initial;
            a->chunks = 1;
        } else {
            free(a);
            a = NULL;
        }
    }
    if (!a) ts_fail(st, TS_NOMEM, "no memory for an arena of %zu bytes", initial);
    return a;
}

static void free_chunks(ts_arena *a)
{
    for (int i = 0; i < a->chunks; i++) free(a->chunk[i].base);
    a->chunks = 0;
    a->at = a->used = 0;
    a->reserved = false;
}

void ts_arena_destroy(ts_arena **arena)
{
    if (!*arena) return;
    free_chunks(*arena);
    free(*arena);
    *arena = NULL;
}

/* A chunk of at least bytes as chunk number a->chunks. What is held grows by half each time, so that MAX_CHUNKS never
 * ends before memory does. */
static int add_chunk(ts_arena *a, size_t bytes)
{
    if (a->chunks == MAX_CHUNKS) return 0;
    size_t held = 0;
    for (int i = 0; i < a->chunks; i++) held += a->chunk[i].size;
    size_t size = held / 2 > bytes ? held / 2 : bytes;
    if (size < MIN_CHUNK) size = MIN_CHUNK;
    size = (size + CHUNK_STEP - 1) / CHUNK_STEP * CHUNK_STEP;
    unsigned char *base = ts_memory(size);
    if (!base && size > bytes) base = ts_memory(size = bytes);
    if (!base) return 0;
    a->chunk[a->chunks].base = base;
    a->chunk[a->chunks].size = size;
    a->chunks++;
    return 1;
}

/* The pages of a reserved chunk come some at a time, one by each thread: what an operation needs of new pages its first
 * number would bring by one thread, and two threads in one page clear it twice. */
static void fetch(ts_arena *a)
{
    const size_t each = CHUNK_STEP, threads = (size_t)(a->threads ? a->threads : ts_threads()),
                 step = each * (threads < 8 ? threads : 8), size = a->chunk[0].size;
    size_t to = (a->used + step - 1) / step * step;
    if (to > size) to = size;
    ts_memory_fetch(a->chunk[0].base + a->fetched, to - a->fetched, a->threads);
    a->fetched = to;
}

void *ts_arena_alloc(ts_arena *a, size_t bytes)
{
    if (bytes > SIZE_MAX / 4) return NULL;
    bytes = bytes ? (bytes + ALIGN - 1) / ALIGN * ALIGN : ALIGN;
    while (a->at >= (size_t)a->chunks || a->used + bytes > a->chunk[a->at].size) {
        if (a->at + 1 < (size_t)a->chunks) {
            a->at++;
        } else {
            if (!add_chunk(a, bytes)) return NULL;
            a->at = (size_t)a->chunks - 1;
        }
        a->used = 0;
    }
    void *p = a->chunk[a->at].base + a->used;
    a->used += bytes;
    if (a->reserved && a->at == 0 && a->used > a->fetched) fetch(a);
    a->total += bytes;
    if (a->total > a->peak) a->peak = a->total;
    return p;
}

void *ts_arena_zalloc(ts_arena *a, size_t count, size_t size)
{
    if (size && count > SIZE_MAX / size) return NULL;
    void *p = ts_arena_alloc(a, count * size);
    if (p) memset(p, 0, count * size);
    return p;
}

ts_mark ts_arena_mark(const ts_arena *a) { return (ts_mark){a->at, a->used, a->total}; }

void ts_arena_release(ts_arena *a, ts_mark mark)
{
    a->at = mark.chunk;
    a->used = mark.used;
    a->total = mark.total;
}

void ts_arena_reserve(ts_arena *a, size_t bytes, int threads)
{
    if (a->total > 0 || bytes > SIZE_MAX / 4 || (a->chunks > 0 && a->chunk[0].size >= bytes)) return;
    free_chunks(a);
    a->reserved = add_chunk(a, bytes);
    a->threads = threads;
    a->fetched = 0;
}

void ts_arena_reset(ts_arena *a)
{
    if (a->chunks > 1) {
        size_t size = a->peak + a->peak / 8; /* room for what fell between chunks */
        free_chunks(a);
        add_chunk(a, size); /* when this fails the next alloc reports it */
    }
    a->at = a->used = a->total = 0;
}

void ts_arena_drop(ts_arena *a)
{
    free_chunks(a);
    a->total = a->peak = 0;
}

size_t ts_arena_used(const ts_arena *a) { return a->total; }
size_t ts_arena_peak(const ts_arena *a) { return a->peak; }
