/* A fast hash that tells contents apart: XXH64 (Collet, "xxHash fast digest algorithm", version 0.1.1), the number that
 * `xxhsum -H64` prints. Not for secrets. */
#ifndef TS_HASH_H
#define TS_HASH_H
#include "tensor/status.h"
#include <stddef.h>
#include <stdint.h>

uint64_t ts_hash(const void *data, size_t size, uint64_t seed);

/* Of a whole file, seed 0. TS_UNSUPPORTED: it is no regular file; TS_IO, TS_NOMEM; messages name it. */
ts_code ts_hash_file(const char *path, uint64_t *hash, ts_status *st);
#endif
