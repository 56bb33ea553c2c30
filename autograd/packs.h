/* Packed weights of convolutions, for the tapes that share them. */
#ifndef AG_PACKS_H
#define AG_PACKS_H
#include "autograd/tape.h"
#include "tensor/conv/conv.h"

typedef struct ag_packs ag_packs;

/* Held by its maker. NULL and st on failure. */
ag_packs *ag_packs_create(ts_status *st);
/* Held by one more: each calls ag_packs_release when it is done, the last one's frees them. Any threads may. */
ag_packs *ag_packs_hold(ag_packs *p);
void ag_packs_release(ag_packs **p);

/* Forgets all of them, keeps the memory. No other holder may be using one. */
void ag_packs_forget(ag_packs *p);

/* From now on a weight of which halves returns other than NULL is packed from that (ts_conv_pack_half) and not read. */
void ag_packs_halves(ag_packs *p, ag_halves halves, void *user);
/* Where a weight is as halves, or NULL. */
const void *ag_packs_half(ag_packs *p, const float *weight);

/* Those of weight for that use, packed at the first request; they stay where they are until forgotten. The key is
 * weight's address, use and c but for n, h and w. Threads may ask at once. NULL when memory is out. */
const float *ag_packs_find(ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight);
/* The same packed into memory of arena and not kept. */
const float *ag_packs_pass(ag_packs *p, const ts_conv *c, ts_conv_use use, const float *weight, ts_arena *arena);
#endif
