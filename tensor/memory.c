#define _DEFAULT_SOURCE /* madvise */
#include "tensor/memory.h"
#include "tensor/team.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

enum { HUGE = 2 << 20 }; /* bytes of a huge page */

void *ts_memory(size_t bytes)
{
    const size_t line = 64, huge = HUGE, align = bytes >= huge / 2 ? huge : line;
    if (bytes > SIZE_MAX - align) return NULL;
    void *p = aligned_alloc(align, (bytes + align - 1) / align * align);
#ifdef MADV_HUGEPAGE
    /* A huge page is cleared in the time of a quarter of its small ones: half of one is worth it. A hint: without it
     * the block is only slower. */
    if (p && align == huge) (void)madvise(p, (bytes + huge / 2) / huge * huge, MADV_HUGEPAGE);
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

static void fetch_pages(const void *job, int64_t begin, int64_t end)
{
#ifdef MADV_POPULATE_WRITE
    char *p = (char *)(uintptr_t)job;
    (void)madvise(p + begin, (size_t)(end - begin), MADV_POPULATE_WRITE); /* a hint: pages come when they are written */
#else
    (void)job, (void)begin, (void)end;
#endif
}

void ts_memory_fetch(void *p, size_t bytes, int threads) { ts_for(threads, (int64_t)bytes, HUGE, fetch_pages, p); }

enum { PART = 128 << 10 };

typedef struct block {
    char *to;
    const char *from; /* NULL: zeros */
} block;

static void fill(const void *job, int64_t begin, int64_t end)
{
    const block *b = job;
    if (b->from) memcpy(b->to + begin, b->from + begin, (size_t)(end - begin));
    else memset(b->to + begin, 0, (size_t)(end - begin));
}

void ts_memory_copy(void *to, const void *from, size_t bytes, int threads)
{
    ts_for(bytes > 2 * PART ? threads : 1, (int64_t)bytes, PART, fill, &(block){to, from});
}

void ts_memory_clear(void *to, size_t bytes, int threads)
{
    ts_for(bytes > 2 * PART ? threads : 1, (int64_t)bytes, PART, fill, &(block){to, NULL});
}
