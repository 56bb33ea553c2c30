/* What the op files share: input checks and the chunks of their parallel loops. */
#ifndef AG_OP_H
#define AG_OP_H
#include "autograd/tape.h"
#include "tensor/team.h"
#include "tensor/threads.h"

/* No error so far and all inputs are there. Sets the error "op: input i is missing" otherwise. */
bool ag_ready(ag_tape *tape, const char *op, int count, ag_value *const *in);

/* Threads of a loop of an operation on the tape. */
static inline int ag_threads(const ag_tape *tape) { return ts_threads_of(ag_compute(tape)->threads); }

/* What a loop over a gradient is given. */
typedef struct ag_back {
    const ag_node *node;
    float *dx;
    bool accumulate; /* dx += in place of dx = */
    int input;       /* whose gradient it is, where a loop is for several */
} ag_back;

/* to[n,h,w,:] = a[n,h,w,:] followed by b[n,h,w,:] (op_concat.c). */
void ag_join(ag_tape *tape, const ag_value *a, const ag_value *b, float *to);

/* to = a + b, of shape s; to may be one of them (op_add.c). */
void ag_sum(ag_tape *tape, ts_shape s, const float *a, const float *b, float *to);

/* Adds the gradient of from, of v's shape, to that of v, if there is a v that needs one; from's own becomes v's where v
 * has none yet, so nothing reads it afterwards (op_add.c). */
void ag_grad_give(ag_tape *tape, ag_value *from, ag_value *v);

/* The recorded operation that made v, or NULL. */
const ag_node *ag_node_of(const ag_tape *tape, const ag_value *v);

/* Loops over values or pixels run in chunks whose size does not depend on the number of threads: ts_for with this step
 * where each value is on its own, ts_tasks or ts_for over the chunks' numbers where a chunk has a sum.
 * 64 KiB: several chunks for every thread at training sizes, and a chunk stays in the L2 cache between the passes over
 * it. */
enum { AG_CHUNK = 1 << 14 };
static inline int64_t ag_part(int64_t n, int64_t first, int64_t chunk) { return n - first < chunk ? n - first : chunk; }
/* The same in pixels of c channels. */
static inline int64_t ag_pixel_chunk(int c) { return c < AG_CHUNK ? AG_CHUNK / c : 1; }

/* The chunks of all images of a shape, each of the pixels of one, and what a loop over them is given. */
typedef struct ag_chunks {
    const ag_node *node;
    int64_t pixels, chunk, parts, tasks; /* of an image; pixels of a chunk; chunks of an image; of all */
    int c;
    void *part, *stat; /* sums of each chunk, values of each image, as the operation has them */
    float *dx;
    bool accumulate;
} ag_chunks;
static inline ag_chunks ag_chunks_of(const ag_node *node, ts_shape s, int64_t chunk)
{
    const int64_t pixels = (int64_t)s.h * s.w, parts = (pixels + chunk - 1) / chunk;
    return (ag_chunks){.node = node, .pixels = pixels, .chunk = chunk, .parts = parts, .tasks = parts * s.n, .c = s.c};
}
/* Of chunk t: its image, how many pixels it has, where its first value is. */
static inline int64_t ag_chunk_image(const ag_chunks *a, int64_t t) { return t / a->parts; }
static inline int64_t ag_chunk_count(const ag_chunks *a, int64_t t)
{
    return ag_part(a->pixels, t % a->parts * a->chunk, a->chunk);
}
static inline int64_t ag_chunk_at(const ag_chunks *a, int64_t t)
{
    return (t / a->parts * a->pixels + t % a->parts * a->chunk) * a->c;
}

/* Whether a program watches (autograd/trace.h); and what it gets to know of the convolution that runs. */
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
