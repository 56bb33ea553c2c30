#include "tensor/scratch.h"
#include "tensor/memory.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

typedef struct scratch {
    void *memory[TS_SCRATCH_SLOTS];
    size_t size[TS_SCRATCH_SLOTS];
} scratch;

static pthread_key_t key;
static pthread_once_t once = PTHREAD_ONCE_INIT;
static void (*on_failure)(size_t bytes);

void ts_scratch_fails(void (*handler)(size_t bytes)) { on_failure = handler; }

static _Noreturn void fail(size_t bytes)
{
    if (on_failure) on_failure(bytes);
    abort();
}

static void free_scratch(void *p)
{
    scratch *s = p;
    for (int i = 0; i < TS_SCRATCH_SLOTS; i++) free(s->memory[i]);
    free(s);
}

static void make_key(void)
{
    if (pthread_key_create(&key, free_scratch) != 0) fail(sizeof(scratch));
}

static atomic_size_t most[TS_SCRATCH_SLOTS]; /* the largest request of any thread */

static scratch *own_scratch(void)
{
    pthread_once(&once, make_key);
    scratch *s = pthread_getspecific(key);
    if (!s) {
        s = calloc(1, sizeof *s);
        if (!s || pthread_setspecific(key, s) != 0) fail(sizeof *s);
    }
    return s;
}

static void grow(scratch *s, int slot, size_t bytes)
{
    if (s->size[slot] >= bytes) return;
    free(s->memory[slot]);
    s->memory[slot] = ts_memory(bytes);
    if (!s->memory[slot]) fail(bytes);
    s->size[slot] = bytes;
}

/* Powers of two while they are small: one layer after the other asks for a little more, and new memory has new pages.
 */
static size_t roomy(size_t bytes)
{
    const size_t page = 4096, small = (size_t)4 << 20;
    size_t room = page;
    while (room < bytes && room < small) room *= 2;
    return room >= bytes ? room : (bytes + page - 1) / page * page;
}

void *ts_scratch(int slot, size_t bytes)
{
    scratch *s = own_scratch();
    if (s->size[slot] < bytes) {
        bytes = roomy(bytes);
        size_t before = atomic_load(&most[slot]);
        while (before < bytes && !atomic_compare_exchange_weak(&most[slot], &before, bytes)) continue;
        grow(s, slot, bytes);
    }
    return s->memory[slot];
}

static void level(const void *job, int k)
{
    (void)job, (void)k;
    scratch *s = own_scratch();
    for (int i = 0; i < TS_SCRATCH_SLOTS; i++) grow(s, i, atomic_load(&most[i]));
}

void ts_scratch_level(int threads)
{
    level(NULL, 0);
    static atomic_size_t level_of[TS_SCRATCH_SLOTS];
    static atomic_int threads_of;
    bool same = atomic_load(&threads_of) >= ts_threads_of(threads);
    for (int i = 0; i < TS_SCRATCH_SLOTS; i++) {
        const size_t now = atomic_load(&most[i]);
        same = atomic_exchange(&level_of[i], now) == now && same;
    }
    if (same) return; /* nobody waits for anybody */
    atomic_store(&threads_of, ts_each_thread(threads, level, NULL));
}
