#define _DEFAULT_SOURCE /* madvise */
#include "tensor/block.h"
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

void *ts_block(size_t bytes)
{
    const size_t line = 64, huge = (size_t)2 << 20, align = bytes >= 2 * huge ? huge : line;
    if (bytes > SIZE_MAX - align) return NULL;
    void *p = aligned_alloc(align, (bytes + align - 1) / align * align);
#ifdef MADV_HUGEPAGE
    if (p && align == huge) (void)madvise(p, bytes / huge * huge, MADV_HUGEPAGE); /* a hint: without it the block is only slower */
#endif
    return p;
}
