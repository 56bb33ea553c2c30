#define _DEFAULT_SOURCE /* madvise */
#include "tensor/memory.h"
#include "tensor/threads.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

void *ts_memory(size_t bytes)
{
    const size_t line = 64, huge = (size_t)2 << 20, align = bytes >= 2 * huge ? huge : line;
    if (bytes > SIZE_MAX - align) return NULL;
    void *p = aligned_alloc(align, (bytes + align - 1) / align * align);
#ifdef MADV_HUGEPAGE
    if (p && align == huge)
        (void)madvise(p, bytes / huge * huge, MADV_HUGEPAGE); /* a hint: without it the block is only slower */
#endif
    return p;
}

void *ts_memory_sparse(size_t bytes)
{
    const size_t page = 4096;
    if (bytes > SIZE_MAX - page) return NULL;
    const size_t whole = (bytes + page - 1) / page * page;
    void *p = aligned_alloc(page, whole);
#ifdef MADV_NOHUGEPAGE
    if (p) (void)madvise(p, whole, MADV_NOHUGEPAGE); /* a hint */
#endif
    return p;
}

enum { PART = 128 << 10 };

void ts_memory_copy(void *to, const void *from, size_t bytes, int threads)
{
#pragma omp parallel for num_threads(ts_threads_of(threads)) schedule(static) if (bytes > 2 * PART)
    for (size_t i = 0; i < bytes; i += PART)
        memcpy((char *)to + i, (const char *)from + i, bytes - i < PART ? bytes - i : PART);
}

void ts_memory_clear(void *to, size_t bytes, int threads)
{
#pragma omp parallel for num_threads(ts_threads_of(threads)) schedule(static) if (bytes > 2 * PART)
    for (size_t i = 0; i < bytes; i += PART) memset((char *)to + i, 0, bytes - i < PART ? bytes - i : PART);
}
