/* Materials made in advance by background threads. Order and bytes depend on the seed alone. */
#ifndef IO_LOADER_H
#define IO_LOADER_H
#include "data/materials/procedural.h"

typedef struct io_loader io_loader;

/* What is taken of every batch: count materials, from number from on. */
typedef struct io_share {
    int batch, from, count;
} io_share;

/* Batches first, first+1, …; batch b holds the materials b*batch .. b*batch+batch-1, of which the share is made.
 * depth batches are kept ready; threads >= 1. */
io_loader *io_loader_create(const io_procedural *p, int size, io_share share, uint64_t first, int depth, int threads,
                            ts_status *st);
/* The next batch's share, [count][size][size][9], valid until the next call. NULL only after an error in a thread (st).
 */
const float *io_loader_next(io_loader *loader, ts_status *st);
void io_loader_destroy(io_loader **loader);
#endif
