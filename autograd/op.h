/* What the op files share: input checks and the chunks of their parallel loops. */
#ifndef AG_OP_H
#define AG_OP_H
#include "autograd/tape.h"
#include "tensor/threads.h"

/* No error so far and all inputs are there. Sets the error "op: input i is missing" otherwise. */
bool ag_ready(ag_tape *tape, const char *op, int count, ag_value *const *in);

/* Threads of a loop of an operation on the tape. */
static inline int ag_threads(const ag_tape *tape) { return ts_threads_of(ag_compute(tape)->threads); }

/* to[n,h,w,:] = a[n,h,w,:] followed by b[n,h,w,:] (op_concat.c). */
void ag_join(ag_tape *tape, const ag_value *a, const ag_value *b, float *to);

/* The recorded operation that made v, or NULL. */
const ag_node *ag_node_of(const ag_tape *tape, const ag_value *v);

/* Loops over values or pixels run in chunks whose size does not depend on the number of threads:
 *     for (int64_t i = 0; i < n; i += AG_CHUNK) f(ag_part(n, i, AG_CHUNK), x + i);
 * 64 KiB: several chunks for every thread at training sizes, and a chunk stays in the L2 cache between the passes over
 * it. */
enum { AG_CHUNK = 1 << 14 };
static inline int64_t ag_part(int64_t n, int64_t first, int64_t chunk) { return n - first < chunk ? n - first : chunk; }
/* The same in pixels of c channels. */
static inline int64_t ag_pixel_chunk(int c) { return c < AG_CHUNK ? AG_CHUNK / c : 1; }

/* Whether a program watches (autograd/trace.h); and what it is told of the convolution that runs. */
bool ag_traced(void);
void ag_trace_way(ag_tape *tape, const char *way);

/* "[n,h,w,c]" for messages; the text lives in the caller's buffer. */
enum { AG_SHAPE_TEXT = 64 };
const char *ag_shape_text(char text[AG_SHAPE_TEXT], ts_shape s);

/* Per-channel sums over pixels: partial sums by chunks of this many pixels (at most about 512 chunks an image). */
static inline int64_t ag_sum_chunk(int64_t pixels, int c)
{
    int64_t least = (pixels + 511) / 512;
    return least > ag_pixel_chunk(c) ? least : ag_pixel_chunk(c);
}
#endif
