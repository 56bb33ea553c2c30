#include "nn/clip.h"
#include "tensor/resize.h"
#include "tensor/team.h"
#include <float.h>
#include <stdatomic.h>

void nn_clip(int64_t count, const float *from, float *to)
{
    for (int64_t i = 0; i < count; i++) {
        const float v = from[i];
        to[i] = !(v > 0 && v <= FLT_MAX) ? 0 : v < 1 ? v : 1;
    }
}

typedef struct inspection {
    const float *from;
    atomic_bool *fine;
} inspection;

static void inspect(const void *job, int64_t begin, int64_t end)
{
    const inspection *i = job;
    bool fine = true;
    for (int64_t k = begin; k < end; k++) fine = fine && i->from[k] >= 0 && i->from[k] <= 1;
    if (!fine) atomic_store(i->fine, false);
}

bool nn_clipped(int64_t count, const float *from, int threads)
{
    enum { STEP = 1 << 12 };
    atomic_bool fine = true;
    ts_for(threads, count, STEP, inspect, &(inspection){from, &fine});
    return fine;
}

typedef struct clipping {
    const float *from;
    float *to;
    int64_t row;
} clipping;

static void clip_rows(const void *job, int64_t begin, int64_t end)
{
    const clipping *c = job;
    nn_clip((end - begin) * c->row, c->from + begin * c->row, c->to + begin * c->row);
}

static ts_code clip_one(const float *image, int side, ts_tensor *to, ts_arena *arena, int threads, ts_status *st)
{
    enum { ROWS = 16 };
    const int64_t row = (int64_t)side * 3;
    ts_tensor whole = ts_view((float *)(uintptr_t)image, (ts_shape){1, side, side, 3});
    if (to->shape.h == side) {
        ts_for(threads, side, ROWS, clip_rows, &(clipping){image, to->data, row});
        return TS_OK;
    }
    if (!nn_clipped(side * row, image, threads)) {
        whole = ts_new(arena, whole.shape);
        if (!whole.data) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", side, side);
        ts_for(threads, side, ROWS, clip_rows, &(clipping){image, whole.data, row});
    }
    return ts_resize(to, &whole, arena, threads, st);
}

ts_code nn_clip_to(const float *const *image, int side, const ts_tensor *small, ts_arena *arena, int threads,
                   ts_status *st)
{
    const ts_shape one = {1, small->shape.h, small->shape.w, 3};
    ts_code code = TS_OK;
    for (int k = 0; k < small->shape.n && !code; k++) {
        const ts_mark mark = ts_arena_mark(arena);
        ts_tensor to = ts_view(small->data + k * ts_count(one), one);
        code = clip_one(image[k], side, &to, arena, threads, st);
        ts_arena_release(arena, mark);
    }
    return code;
}
