/* A bucket of gradients that the ranks of a host sum in parts, each rank one, where they lie (tr_mpi.share). */
#ifndef TR_PARTS_H
#define TR_PARTS_H
#include <stddef.h>

/* Where part number `part` of count values begins, 0 .. parts; number `parts` begins at the end. Parts are whole cache
 * lines but for the last. */
static inline size_t tr_part(size_t count, int parts, int part)
{
    const size_t line = 16, each = (count + line * (size_t)parts - 1) / (line * (size_t)parts) * line;
    return (size_t)part * each < count ? (size_t)part * each : count;
}

/* to[at .. at + count) = the sum of value[0 .. ranks - 1][at .. at + count), in this order; zeros there, but in `to`,
 * which is one of them or none. */
void tr_add_parts(float *const *value, int ranks, size_t at, size_t count, float *to);
#endif
