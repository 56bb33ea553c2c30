#include "autograd/packs.h"
#include "tensor/arena.h"
#include <pthread.h>
#include <stdlib.h>

typedef struct pack {
    const float *weight;
    ts_conv_use use;
    ts_conv conv; /* n, h, w play no part */
    float *packed;
} pack;

struct ag_packs {
    pthread_mutex_t lock;
    ts_arena *arena;
    pack *pack; /* grown by doubling and never shrunk */
    size_t count, capacity;
    int holders;
    ag_halves halves;
    void *user;
};

ag_packs *ag_packs_create(ts_status *st)
{
    ag_packs *p = calloc(1, sizeof *p);
    if (!p) {
        ts_fail(st, TS_NOMEM, "no memory for packed weights");
        return NULL;
    }
    *p = (ag_packs){.lock = PTHREAD_MUTEX_INITIALIZER, .holders = 1};
    p->arena = ts_arena_create(0, st);
    if (!p->arena) ag_packs_release(&p);
    return p;
}

ag_packs *ag_packs_hold(ag_packs *p)
{
    pthread_mutex_lock(&p->lock);
    p->holders++;
    pthread_mutex_unlock(&p->lock);
    return p;
}

void ag_packs_release(ag_packs **pp)
{
    ag_packs *p = *pp;
    *pp = NULL;
    if (!p) return;
    pthread_mutex_lock(&p->lock);
    const int left = --p->holders;
    pthread_mutex_unlock(&p->lock);
    if (left > 0) return;
    pthread_mutex_destroy(&p->lock);
    ts_arena_destroy(&p->arena);
    free(p->pack);
    free(p);
}

void ag_packs_forget(ag_packs *p)
{
    pthread_mutex_lock(&p->lock);
    ts_arena_reset(p->arena);
    p->count = 0;
    pthread_mutex_unlock(&p->lock);
}

void ag_packs_halves(ag_packs *p, ag_halves halves, void *user)
{
    pthread_mutex_lock(&p->lock);
    p->halves = halves;
    p->user = user;
    pthread_mutex_unlock(&p->lock);
}

const void *ag_packs_half(ag_packs *p, const float *weight)
{
    pthread_mutex_lock(&p->lock);
    const void *half = p->halves ? p->halves(weight, p->user) : NULL;
    pthread_mutex_unlock(&p->lock);
    return half;
}

static bool is(const pack *p, const ts_conv *c, ts_conv_use use, const float *weight)
{
    const ts_conv *has = &p->conv;
    return p->weight == weight && p->use == use && has->ic == c->ic && has->oc == c->oc && has->k == c->k &&
        has->dilation == c->dilation && has->pad == c->pad && has->constants == c->constants;
}

static bool grow(ag_packs *p)
{
    if (p->count < p->capacity) return true;
    const size_t more = p->capacity ? 2 * p->capacity : 256;
    pack *grown = realloc(p->pack, more * sizeof *grown);
    if (!grown) return false;
    p->pack = grown;
    p->capacity = more;
    return true;
}

/* packed: NULL is passed on. */
static const float *fill(const ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight, float *packed)
{
    const void *half = packed && p->halves ? p->halves(weight, p->user) : NULL;
    if (packed && !half) ts_conv_pack(c, use, weight, packed);
    return half && !ts_conv_pack_half(c, use, half, packed) ? NULL : packed;
}

static const float *find(ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight)
{
    for (size_t i = 0; i < p->count; i++)
        if (is(&p->pack[i], c, use, weight)) return p->pack[i].packed;
    float *packed = ts_arena_alloc(p->arena, ts_conv_packed_count(c, use) * sizeof(float));
    if (!packed || !grow(p) || !fill(p, c, use, weight, packed)) return NULL;
    p->pack[p->count++] = (pack){weight, use, *c, packed};
    return packed;
}

const float *ag_packs_find(ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight)
{
    pthread_mutex_lock(&p->lock);
    const float *packed = find(p, c, use, weight);
    pthread_mutex_unlock(&p->lock);
    return packed;
}

const float *ag_packs_pass(ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight, ts_arena *arena)
{
    return fill(p, c, use, weight, ts_arena_alloc(arena, ts_conv_packed_count(c, use) * sizeof(float)));
}
