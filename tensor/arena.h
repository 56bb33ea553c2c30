/* A growing bump allocator. Blocks are 64-byte aligned and uninitialised. Not thread safe. */
#ifndef TS_ARENA_H
#define TS_ARENA_H
#include "tensor/status.h"
#include <stddef.h>

typedef struct ts_arena ts_arena;

typedef struct ts_mark {
    size_t chunk, used, total;
} ts_mark;

/* initial: bytes taken at once (0 = at the first allocation). NULL and st set on failure. The caller destroys it. */
ts_arena *ts_arena_create(size_t initial, ts_status *st);

/* Frees everything and nulls the pointer; a NULL pointer is left alone. */
void ts_arena_destroy(ts_arena **arena);

/* bytes of memory, valid until the arena is reset, destroyed or released to an earlier mark; NULL when there is none.
 */
void *ts_arena_alloc(ts_arena *arena, size_t bytes);

/* The same for count items of size bytes, NULL when the product overflows, and filled with zeros. */
void *ts_arena_zalloc(ts_arena *arena, size_t count, size_t size);

/* Stack discipline inside an arena: everything allocated after the mark is given back by release. */
ts_mark ts_arena_mark(const ts_arena *arena);
void ts_arena_release(ts_arena *arena, ts_mark mark);

/* For an arena that is empty: what is allocated next lies in one piece of at least bytes, so that memory that was given
 * back is the next to be used; of several pieces the later ones are new, and the system clears new memory, on so many
 * threads (0: the process's number). Pieces that are too small are given back to the system first; what is larger
 * already stays. A hint: where there is less memory, what is allocated comes in pieces as without. */
void ts_arena_reserve(ts_arena *arena, size_t bytes, int threads);

/* Gives everything back. Several chunks are merged into one of the peak's size, so that a repeated
 * workload allocates nothing from its third round on. */
void ts_arena_reset(ts_arena *arena);

/* The same, and the memory goes back to the system. */
void ts_arena_drop(ts_arena *arena);

/* Bytes in use now, and the most that ever was (since ts_arena_drop). */
size_t ts_arena_used(const ts_arena *arena);
size_t ts_arena_peak(const ts_arena *arena);
#endif
