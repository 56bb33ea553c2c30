#include "tensor/resize.h"
#include "tensor/resample.h"

ts_code ts_resize(ts_tensor *dst, const ts_tensor *src, ts_arena *arena, int threads, ts_status *st)
{
    const ts_shape d = dst->shape, s = src->shape;
    if (d.n != s.n || d.c != s.c)
        return ts_fail(st, TS_INVALID, "resize: %d images of %d channels into %d images of %d channels", s.n, s.c, d.n,
                       d.c);
    if (!ts_contiguous(dst) || !ts_contiguous(src))
        return ts_fail(st, TS_INVALID, "resize: both images must be contiguous");
    const ts_mark mark = ts_arena_mark(arena);
    const ts_taps rows = ts_taps_triangle(arena, s.h, d.h), columns = ts_taps_triangle(arena, s.w, d.w);
    ts_code code = TS_OK;
    if (rows.weight && columns.weight) ts_resample(s.n, s.c, &rows, &columns, src->data, dst->data, false, threads);
    else code = ts_fail(st, TS_NOMEM, "resize: no memory for the filter of %dx%d to %dx%d", s.w, s.h, d.w, d.h);
    ts_arena_release(arena, mark);
    return code;
}
