/* Map sets of a folder, kept in memory so that materials can be made of parts of them. */
#ifndef IO_COLLECTION_H
#define IO_COLLECTION_H
#include "data/material.h"
#include "tensor/maps.h"
#include <stdbool.h>
#include <stdint.h>

enum { IO_COLLECTION_SIDE = 512, IO_COLLECTED = 7 };

/* A pixel of a set. The sets are taken to repeat. */
typedef struct io_collected {
    float height;                 /* in sides of the set, mean 0 */
    uint16_t value[IO_COLLECTED]; /* diffuse 3, F0 3, roughness; 65535 is 1 */
} io_collected;

typedef struct io_collection io_collection;

/* Every folder in path is a map folder (data/material.h), in the order of their names; 5.2 MB of memory for each. One
 * that cannot be read is an error that names it. stop: NULL, or asked before each; true ends with TS_INTERRUPTED. NULL
 * on failure. io_collection_free takes NULL too. */
io_collection *io_collection_read(const char *path, int threads, bool (*stop)(void *user), void *user, ts_status *st);
int io_collection_count(const io_collection *collection);
/* Of the sets' files: it tells collections apart, not the places where they are. */
uint64_t io_collection_hash(const io_collection *collection);
/* Of set number 0 .. count - 1, the collection's: [IO_COLLECTION_SIDE][IO_COLLECTION_SIDE]. */
const io_collected *io_collection_get(const io_collection *collection, int number);
void io_collection_free(io_collection **collection);
#endif
