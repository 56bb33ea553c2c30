/* Separable linear filters on [N, H, W, C] images: upsampling, resizing, and their transposes (gradients) are all one
 * of these. */
#ifndef TS_RESAMPLE_H
#define TS_RESAMPLE_H
#include "tensor/tensor.h"

/* A sparse matrix from in to out positions along one axis: out j = sum over k < offset[j + 1] - offset[j] of
 * weight[offset[j] + k] * in (first[j] + k). Lives in an arena; weight is NULL where memory was out. */
typedef struct ts_taps {
    int in, out;
    int *first;    /* [out] */
    int *offset;   /* [out + 1] */
    float *weight; /* [offset[out]] */
} ts_taps;

/* Linear interpolation with the first and the last positions of both falling on each other: source = j (in - 1) / (out
 * - 1). */
ts_taps ts_taps_aligned(ts_arena *arena, int in, int out);

/* Triangle filter of half-width max(1, in / out) around (j + 1/2) in / out - 1/2, positions outside read the edge's
 * value. */
ts_taps ts_taps_triangle(ts_arena *arena, int in, int out);

/* To more positions by Mitchell and Netravali's cubic with B = .6 and C = .2, of half-width 2: with continuous slopes,
 * which linear interpolation has not, a little blurred, and up to 1.3% of a step beyond the values. To as many or fewer
 * the triangle filter. */
ts_taps ts_taps_smooth(ts_arena *arena, int in, int out);

/* The taps of out positions first .. first + count - 1 alone: views of t. offset counts from the first of all, so the
 * weights stay where they are. */
static inline ts_taps ts_taps_part(const ts_taps *t, int first, int count)
{
    return (ts_taps){t->in, count, t->first + first, t->offset + first, t->weight};
}

/* The transposed matrix. */
ts_taps ts_taps_transpose(ts_arena *arena, const ts_taps *t);

/* y (+)= x filtered. x: [n, rows->in, columns->in, c], y: [n, rows->out, columns->out, c]. Threaded over rows of y;
 * threads 0: the process's number. */
void ts_resample(int n, int c, const ts_taps *rows, const ts_taps *columns, const float *x, float *y, bool accumulate,
                 int threads);

/* The same by the transposed filters, which the arena holds while it lasts: x: [n, rows->out, columns->out, c], y: [n,
 * rows->in, columns->in, c]. False: no memory for them, or rows or columns have no weights. */
bool ts_resample_transposed(ts_arena *arena, int n, int c, const ts_taps *rows, const ts_taps *columns, const float *x,
                            float *y, bool accumulate, int threads);
#endif
