/* A view of float32 memory with a shape. Images are [N, H, W, C] (channels fastest), vectors [N, C] as [N, 1, 1, C],
 * scalars [1, 1, 1, 1]: every tensor has four dimensions. A tensor owns nothing. */
#ifndef TS_TENSOR_H
#define TS_TENSOR_H
#include "tensor/arena.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct ts_shape {
    int n, h, w, c; /* each >= 1 */
} ts_shape;

typedef struct ts_tensor {
    float *data;
    ts_shape shape;
    int64_t stride_n, stride_h, stride_w; /* in floats; the channel stride is 1 */
} ts_tensor;

int64_t ts_count(ts_shape s);  /* number of values */
int64_t ts_pixels(ts_shape s); /* n * h * w */
bool ts_same(ts_shape a, ts_shape b);
bool ts_contiguous(const ts_tensor *t);

/* A contiguous view of data with the given shape. */
ts_tensor ts_view(float *data, ts_shape shape);

/* Contiguous, from the arena, uninitialised (data is NULL when there is no memory or a dimension is < 1). */
ts_tensor ts_new(ts_arena *arena, ts_shape shape);

/* A view without a copy: the rectangle of h rows and w columns from (y, x) of each image. */
ts_tensor ts_window(const ts_tensor *t, int y, int x, int h, int w);

/* dst = src for any strides; shapes are equal. */
void ts_copy(ts_tensor *dst, const ts_tensor *src);
#endif
