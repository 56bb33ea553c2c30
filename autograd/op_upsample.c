/* y[n,i,j,c] = bilinear x[n, i (H-1)/(2H-1), j (W-1)/(2W-1), c]: twice the size, corners on corners;   dx = the
 * transposed weights on dy
 *
 * x: [N,H,W,C], y: [N,2H,2W,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/resample.h"
#include <math.h>

#ifdef AG_API
/* Bilinear, twice the size, corners aligned: [N,H,W,C] to [N,2H,2W,C]. */
ag_value *ag_upsample(ag_tape *tape, ag_value *x);
#endif

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    const ts_taps rows = ts_taps_aligned(ag_arena(tape), s.h, 2 * s.h),
                  columns = ts_taps_aligned(ag_arena(tape), s.w, 2 * s.w);
    if (rows.weight && columns.weight)
        ts_resample(s.n, s.c, &rows, &columns, node->in[0]->t.data, node->out->t.data, false, ag_threads(tape));
    else ag_fail(tape, TS_NOMEM, "upsample: no memory for the weights");
    ts_arena_release(ag_arena(tape), mark);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (!dx) return;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    const ts_taps rows = ts_taps_aligned(ag_arena(tape), s.h, 2 * s.h),
                  columns = ts_taps_aligned(ag_arena(tape), s.w, 2 * s.w);
    if (!ts_resample_transposed(ag_arena(tape), s.n, s.c, &rows, &columns, node->out->grad, dx, accumulate,
                                ag_threads(tape)))
        ag_fail(tape, TS_NOMEM, "upsample: no memory for the weights");
    ts_arena_release(ag_arena(tape), mark);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape;
    for (int n = 0; n < s.n; n++)
        for (int i = 0; i < 2 * s.h; i++)
            for (int j = 0; j < 2 * s.w; j++)
                for (int c = 0; c < s.c; c++) {
                    const double y = i * (s.h - 1.0) / (2 * s.h - 1), x = j * (s.w - 1.0) / (2 * s.w - 1);
                    const int y0 = (int)y, x0 = (int)x, y1 = y0 + 1 < s.h ? y0 + 1 : y0,
                              x1 = x0 + 1 < s.w ? x0 + 1 : x0;
                    const double *a = in[0] + ((int64_t)n * s.h + y0) * s.w * s.c + c,
                                 *b = in[0] + ((int64_t)n * s.h + y1) * s.w * s.c + c;
                    *out++ = (1 - y + y0) * ((1 - x + x0) * a[x0 * s.c] + (x - x0) * a[x1 * s.c]) +
                        (y - y0) * ((1 - x + x0) * b[x0 * s.c] + (x - x0) * b[x1 * s.c]);
                }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_upsample(tape, in[0]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    ag_case one = {.label = "one pixel", .inputs = 1, .shape = {{2, 1, 1, 3}}, .lo = -1, .hi = 1, .build = build};
    ag_gradcheck_run(check, &one);
    for (int i = 0; i < 6; i++) {
        ag_case c = {.label = "random", .inputs = 1, .lo = -1, .hi = 1, .build = build};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 6), 1 + ts_rng_int(r, 6),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_upsample = {"upsample", forward, backward, reference, cases};

ag_value *ag_upsample(ag_tape *tape, ag_value *x)
{
    if (!ag_ready(tape, "upsample", 1, &x)) return NULL;
    const ts_shape s = x->t.shape;
    return ag_apply(tape, &op_upsample, 1, &x, (ts_shape){s.n, 2 * s.h, 2 * s.w, s.c}, NULL, 0);
}
