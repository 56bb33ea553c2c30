/* y = base + A x B^T for every image and channel: A and B hold a filter of tensor/resample.h for rows and columns;
 * dx = A^T dy B, dbase = dy   x: [N,H,W,C], y and base: [N,h,w,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/resample.h"
#include <math.h>

#ifdef AG_API
/* x [N,H,W,C] resampled to [N,h,w,C] as ts_resize does. */
ag_value *ag_resize(ag_tape *tape, ag_value *x, int h, int w);
/* The same, but larger images as ts_taps_smooth makes them. */
ag_value *ag_resize_smooth(ag_tape *tape, ag_value *x, int h, int w);
/* base [N,h,w,C] + the same of x; ag_into base: in its place. */
ag_value *ag_resize_smooth_add(ag_tape *tape, ag_value *base, ag_value *x);
#endif

enum { X, BASE, INPUTS };

typedef struct resize_attr {
    bool smooth;
} resize_attr;

static ts_taps taps(ag_tape *tape, const ag_node *node, int in, int out)
{
    const resize_attr *a = node->attr;
    return (a->smooth ? ts_taps_smooth : ts_taps_triangle)(ag_arena(tape), in, out);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[X]->t.shape, d = node->out->t.shape;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    const ts_taps rows = taps(tape, node, s.h, d.h), columns = taps(tape, node, s.w, d.w);
    const ag_value *base = node->in[BASE];
    float *y = node->out->t.data;
    const bool in_place = base && base->t.data == y;
    if (rows.weight && columns.weight) {
        ts_resample(s.n, s.c, &rows, &columns, node->in[X]->t.data, y, in_place, ag_threads(tape));
        if (base && !in_place) ag_sum(tape, d, y, base->t.data, y);
    } else ag_fail(tape, TS_NOMEM, "resize: no memory for the filter");
    ts_arena_release(ag_arena(tape), mark);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape, d = node->out->t.shape;
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[X], &accumulate);
    if (dx) {
        const ts_mark mark = ts_arena_mark(ag_arena(tape));
        const ts_taps rows = taps(tape, node, s.h, d.h), columns = taps(tape, node, s.w, d.w);
        if (!ts_resample_transposed(ag_arena(tape), s.n, s.c, &rows, &columns, node->out->grad, dx, accumulate,
                                    ag_threads(tape)))
            ag_fail(tape, TS_NOMEM, "resize: no memory for the filter");
        ts_arena_release(ag_arena(tape), mark);
    }
    ag_grad_give(tape, node->out, node->in[BASE]);
}

/* Weight of (any, also outside) source position i in output j, before the sum over i is made 1. */
static double weight_of(bool smooth, int in, int out, int j, int i)
{
    const double step = (double)in / out, radius = step > 1 ? step : 1, d = fabs(i - (j + 0.5) * step + 0.5) / radius;
    if (!smooth || out <= in) return d < 1 ? 1 - d : 0;
    const double far = fmax(2 - d, 0), near = fmax(1 - d, 0), b = 0.6,
                 c = 0.2; /* of Mitchell and Netravali: the B-spline's part in truncated powers, and Keys's */
    const double keys = d < 1 ? d * d * (1 - d)
        : d < 2               ? -(d - 1) * far * far
                              : 0,
                 linear = d < 1 ? (1 + 2 * d) * near * near : 0;
    return b * (far * far * far - 4 * near * near * near) / 6 + (1 - b) * linear + c * keys;
}

static int edge(int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; }

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape, d = node->out->t.shape;
    const bool smooth = ((const resize_attr *)node->attr)->smooth;
    for (int64_t q = 0; q < ts_count(d); q++) {
        const int c = (int)(q % d.c), j = (int)(q / d.c % d.w), i = (int)(q / d.c / d.w % d.h),
                  n = (int)(q / d.c / d.w / d.h);
        double sum = 0, weights = 0;
        for (int y = -s.h; y < 2 * s.h; y++)
            for (int x = -s.w; x < 2 * s.w; x++) {
                const double w = weight_of(smooth, s.h, d.h, i, y) * weight_of(smooth, s.w, d.w, j, x);
                weights += w;
                sum += w * in[0][(((int64_t)n * s.h + edge(y, s.h)) * s.w + edge(x, s.w)) * s.c + c];
            }
        out[q] = sum / weights + (in[BASE] ? in[BASE][q] : 0);
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const int *size = user;
    if (in[BASE]) return ag_resize_smooth_add(tape, in[BASE], in[X]);
    return (size[2] ? ag_resize_smooth : ag_resize)(tape, in[0], size[0], size[1]);
}

static void cases(ag_gradcheck *check)
{
    static const struct {
        const char *label;
        ts_shape in;
        int out[3];
    } edges[] = {
        {"the same size", {1, 4, 3, 2}, {4, 3}},
        {"to one pixel", {2, 5, 4, 3}, {1, 1}},
        {"from one pixel", {1, 1, 1, 3}, {3, 4}},
        {"half", {1, 6, 8, 5}, {3, 4}},
        {"up and down", {1, 3, 7, 2}, {8, 3}},
        {"smooth", {1, 3, 7, 2}, {8, 19, 1}},
        {"smooth from one pixel", {1, 1, 1, 3}, {3, 4, 1}},
        {"smooth up and down", {1, 5, 4, 2}, {6, 3, 1}},
    };
    ts_rng *r = ag_gradcheck_rng(check);
    for (size_t i = 0; i < sizeof edges / sizeof *edges; i++) {
        ag_case c = {.label = edges[i].label,
                     .inputs = edges[i].out[2] ? INPUTS : BASE,
                     .shape = {edges[i].in, {edges[i].in.n, edges[i].out[0], edges[i].out[1], edges[i].in.c}},
                     .lo = -1,
                     .hi = 1,
                     .build = build,
                     .user = edges[i].out};
        ag_gradcheck_run(check, &c);
    }
    for (int i = 0; i < 4; i++) {
        const int size[3] = {1 + ts_rng_int(r, 10), 1 + ts_rng_int(r, 10), i % 2};
        ag_case c = {.label = "random", .inputs = 1, .lo = -1, .hi = 1, .build = build, .user = size};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 2), 1 + ts_rng_int(r, 9), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 20)};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_resize = {"resize", forward, backward, reference, cases};

static ag_value *resize(ag_tape *tape, ag_value *x, ag_value *base, int h, int w, bool smooth)
{
    const resize_attr attr = {smooth};
    if (!ag_ready(tape, "resize", 1, &x)) return NULL;
    if (h < 1 || w < 1) return ag_fail(tape, TS_INVALID, "resize: to %d x %d pixels", h, w);
    const ts_shape y = {x->t.shape.n, h, w, x->t.shape.c};
    char text[AG_SHAPE_TEXT], more[AG_SHAPE_TEXT];
    if (base && !ts_same(base->t.shape, y))
        return ag_fail(tape, TS_INVALID, "resize: %s is added to %s, which differs", ag_shape_text(text, y),
                       ag_shape_text(more, base->t.shape));
    return ag_apply(tape, &op_resize, INPUTS, (ag_value *[INPUTS]){x, base}, y, &attr, sizeof attr);
}

ag_value *ag_resize(ag_tape *tape, ag_value *x, int h, int w) { return resize(tape, x, NULL, h, w, false); }
ag_value *ag_resize_smooth(ag_tape *tape, ag_value *x, int h, int w) { return resize(tape, x, NULL, h, w, true); }
ag_value *ag_resize_smooth_add(ag_tape *tape, ag_value *base, ag_value *x)
{
    if (!ag_ready(tape, "resize", 1, &base)) return NULL;
    return resize(tape, x, base, base->t.shape.h, base->t.shape.w, true);
}
