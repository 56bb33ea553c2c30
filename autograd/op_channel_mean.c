/* y[n,c] = mean over the P pixels p of x[n,p,c],   dx[n,p,c] = dy[n,c] / P
 * x: [N,H,W,C], y: [N,1,1,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/kernels/norm.h"

#ifdef AG_API
/* The mean over the pixels of each image: [N,H,W,C] to [N,1,1,C]. */
ag_value *ag_channel_mean(ag_tape *tape, ag_value *x);
#endif

static void forward(ag_tape *tape, ag_node *node)
{
    const struct ts_norm_kernels *k = ts_norm_k();
    const ts_shape s = node->in[0]->t.shape;
    const int c = s.c;
    const float *x = node->in[0]->t.data;
    float *y = node->out->t.data;
    const int64_t pixels = (int64_t)s.h * s.w, chunk = ag_sum_chunk(pixels, c), parts = (pixels + chunk - 1) / chunk,
                  tasks = parts * s.n;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = ts_arena_zalloc(ag_arena(tape), (size_t)tasks * (size_t)c, sizeof(double)); /* [N][parts][C] */
    if (!part) {
        ag_fail(tape, TS_NOMEM, "channel_mean: no memory for the sums");
        return;
    }
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (tasks > 1)
    for (int64_t t = 0; t < tasks; t++) {
        const int64_t p = t % parts * chunk;
        k->sums(ag_part(pixels, p, chunk), c, x + (t / parts * pixels + p) * c, part + t * c);
    }
    for (int64_t i = 0; i < (int64_t)s.n * c; i++) {
        double sum = 0;
        for (int64_t t = 0; t < parts; t++) sum += part[(i / c * parts + t) * c + i % c];
        y[i] = (float)(sum / (double)pixels);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const ts_shape s = node->in[0]->t.shape;
    const int c = s.c;
    const float *dy = node->out->grad;
    const int64_t pixels = (int64_t)s.h * s.w, chunk = ag_pixel_chunk(c), parts = (pixels + chunk - 1) / chunk,
                  tasks = parts * s.n;
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (!dx) return;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    float *each = ts_arena_alloc(ag_arena(tape), (size_t)s.n * (size_t)c * sizeof(float)); /* dy / P: [N][C] */
    if (!each) {
        ag_fail(tape, TS_NOMEM, "channel_mean: no memory for the gradient");
        return;
    }
    k->scale((int64_t)s.n * c, (float)(1.0 / (double)pixels), dy, each, false);
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (tasks > 1)
    for (int64_t t = 0; t < tasks; t++) {
        const int64_t n = t / parts, p = t % parts * chunk;
        k->broadcast(ag_part(pixels, p, chunk), c, each + n * c, dx + (n * pixels + p) * c, accumulate);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    for (int64_t i = 0; i < (int64_t)s.n * s.c; i++) {
        out[i] = 0;
        for (int64_t p = 0; p < pixels; p++) out[i] += in[0][(i / s.c * pixels + p) * s.c + i % s.c] / (double)pixels;
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_channel_mean(tape, in[0]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 5; i++) {
        ag_case c = {.label = "random", .inputs = 1, .lo = -1, .hi = 2, .build = build};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case big = {
        .label = "several chunks", .inputs = 1, .shape = {{2, 70, 61, 7}}, .lo = -1, .hi = 3, .build = build};
    ag_gradcheck_run(check, &big);
}

const ag_op op_channel_mean = {"channel_mean", forward, backward, reference, cases};

ag_value *ag_channel_mean(ag_tape *tape, ag_value *x)
{
    if (!ag_ready(tape, "channel_mean", 1, &x)) return NULL;
    return ag_apply(tape, &op_channel_mean, 1, &x, (ts_shape){x->t.shape.n, 1, 1, x->t.shape.c}, NULL, 0);
}
