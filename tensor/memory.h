/* Memory for numbers: where arenas, scratch and parameters come from. */
#ifndef TS_MEMORY_H
#define TS_MEMORY_H
#include <stddef.h>

/* bytes, aligned to 64, contents undefined; NULL when there is none. The caller frees with free(). A large block is
 * offered to the kernel for huge pages: one fault instead of 512, and convolutions miss the TLB less. */
void *ts_memory(size_t bytes);
/* The same for a block of which little is ever touched: no huge pages. */
void *ts_memory_sparse(size_t bytes);
/* Brings the pages of such memory, which begins with a huge one, before they are written to one by one: a huge page by
 * each of threads (0: the process's number). */
void ts_memory_fetch(void *p, size_t bytes, int threads);
/* memcpy, and memset to zeros, by so many threads (0: the process's number) where there is much to do. */
void ts_memory_copy(void *to, const void *from, size_t bytes, int threads);
void ts_memory_clear(void *to, size_t bytes, int threads);
#endif
