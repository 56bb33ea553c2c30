/* Scopes: what is kept moves down in the arena, to where the scope began. */
#include "autograd/tape_internal.h"
#include "tensor/memory.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* A value that is kept: where it is, and where it goes. */
typedef struct kept {
    int index;
    const float *from;
    ts_shape shape;
    size_t bytes;
    ag_held *header;
    float *to;
    size_t born;
} kept;

ts_mark ag_scope_begin(ag_tape *tape) { return ts_arena_mark(tape->arena); }

static int by_place(const void *a, const void *b)
{
    const uintptr_t x = (uintptr_t)((const kept *)a)->from, y = (uintptr_t)((const kept *)b)->from;
    return (x > y) - (x < y);
}

static bool apart(const void *a, size_t a_bytes, const void *b, size_t b_bytes)
{
    const uintptr_t x = (uintptr_t)a, y = (uintptr_t)b;
    return x + a_bytes <= y || y + b_bytes <= x;
}

/* Whether each can be moved in turn, data before header, with nothing written over that is still to be moved. */
static bool movable(const kept *k, int count)
{
    for (int i = 0; i < count; i++) {
        if (!apart(k[i].header, sizeof(ag_held), k[i].from, k[i].bytes)) return false;
        for (int j = i + 1; j < count; j++)
            if (!apart(k[i].header, sizeof(ag_held), k[j].from, k[j].bytes) ||
                !apart(k[i].to, k[i].bytes, k[j].from, k[j].bytes))
                return false;
    }
    return true;
}

/* Data is copied by all threads where its two places are apart. */
static void copy(const ag_tape *tape, float *to, const float *from, size_t bytes)
{
    if (apart(to, bytes, from, bytes)) ts_memory_copy(to, from, bytes, tape->compute.threads);
    else memmove(to, from, bytes);
}

/* What cannot be moved at once goes out of the way first. */
static bool put_aside(ag_tape *tape, kept *k, int count)
{
    for (int i = 0; i < count; i++) {
        float *aside = ts_arena_alloc(tape->moving, k[i].bytes);
        if (!aside) return false;
        copy(tape, aside, k[i].from, k[i].bytes);
        k[i].from = aside;
    }
    return true;
}

/* Takes the places from the mark on, and writes nothing there yet. */
static bool take_places(ag_tape *tape, ts_mark mark, kept *k, int count)
{
    ts_arena_release(tape->arena, mark);
    for (int i = 0; i < count; i++) {
        k[i].born = ts_arena_used(tape->arena);
        k[i].header = ts_arena_alloc(tape->arena, sizeof *k[i].header);
        k[i].to = ts_arena_alloc(tape->arena, k[i].bytes);
        if (!k[i].header || !k[i].to) return false;
    }
    return movable(k, count) || put_aside(tape, k, count);
}

void ag_scope_end(ag_tape *tape, ts_mark mark, ag_value **keep, int count)
{
    if (tape->gradients) return;
    const ts_mark moving = ts_arena_mark(tape->moving), full = ts_arena_mark(tape->arena);
    kept *k = count > 0 ? ts_arena_alloc(tape->moving, (size_t)count * sizeof *k) : NULL;
    int moved = 0;
    for (int i = 0; k && i < count; i++) {
        if (!keep[i] || ((const ag_held *)keep[i])->born < mark.total) continue;
        const ts_tensor *t = &keep[i]->t;
        k[moved++] = (kept){
            .index = i, .from = t->data, .shape = t->shape, .bytes = (size_t)ts_count(t->shape) * sizeof *t->data};
    }
    if (moved) qsort(k, (size_t)moved, sizeof *k, by_place);
    if ((count > 0 && !k) || !take_places(tape, mark, k, moved)) { /* nothing is lost: the memory stays taken */
        ts_arena_release(tape->arena, full);
        ag_no_memory(tape, "the values that a scope keeps");
    } else
        for (int i = 0; i < moved; i++) {
            copy(tape, k[i].to, k[i].from, k[i].bytes);
            *k[i].header = (ag_held){{.t = ts_view(k[i].to, k[i].shape)}, k[i].born};
            keep[k[i].index] = tape->status.code ? NULL : &k[i].header->v;
        }
    ts_arena_release(tape->moving, moving);
    if (ts_arena_used(tape->moving) == 0) ts_arena_reset(tape->moving); /* several chunks become one */
}
