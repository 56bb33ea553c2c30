#include "tensor/tensor.h"
#include <string.h>

int64_t ts_count(ts_shape s) { return (int64_t)s.n * s.h * s.w * s.c; }
int64_t ts_pixels(ts_shape s) { return (int64_t)s.n * s.h * s.w; }
bool ts_same(ts_shape a, ts_shape b) { return a.n == b.n && a.h == b.h && a.w == b.w && a.c == b.c; }

bool ts_contiguous(const ts_tensor *t)
{
    const ts_tensor c = ts_view(t->data, t->shape);
    return t->stride_n == c.stride_n && t->stride_h == c.stride_h && t->stride_w == c.stride_w;
}

ts_tensor ts_view(float *data, ts_shape s)
{
    const int64_t row = (int64_t)s.w * s.c;
    return (ts_tensor){data, s, s.h * row, row, s.c};
}

ts_tensor ts_new(ts_arena *arena, ts_shape s)
{
    size_t bytes = sizeof(float);
    const int sides[] = {s.n, s.h, s.w, s.c};
    for (int i = 0; i < 4; i++)
        if (sides[i] < 1 || __builtin_mul_overflow(bytes, (size_t)sides[i], &bytes)) return (ts_tensor){.shape = s};
    return ts_view(ts_arena_alloc(arena, bytes), s);
}

ts_tensor ts_window(const ts_tensor *t, int y, int x, int h, int w)
{
    ts_tensor r = *t;
    r.data += y * t->stride_h + x * t->stride_w;
    r.shape.h = h;
    r.shape.w = w;
    return r;
}

void ts_copy(ts_tensor *dst, const ts_tensor *src)
{
    const ts_shape s = src->shape;
    if (ts_contiguous(dst) && ts_contiguous(src)) {
        memmove(dst->data, src->data, (size_t)ts_count(s) * sizeof(float));
        return;
    }
    for (int n = 0; n < s.n; n++)
        for (int y = 0; y < s.h; y++) {
            float *d = dst->data + n * dst->stride_n + y * dst->stride_h;
            const float *p = src->data + n * src->stride_n + y * src->stride_h;
            for (int x = 0; x < s.w; x++, d += dst->stride_w, p += src->stride_w)
                memcpy(d, p, (size_t)s.c * sizeof(float));
        }
}
