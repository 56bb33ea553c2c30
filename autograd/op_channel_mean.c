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

static void sum_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++)
        ts_norm_k()->sums(ag_chunk_count(a, t), a->c, a->node->in[0]->t.data + ag_chunk_at(a, t),
                          (double *)a->part + t * a->c);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    const int c = s.c;
    float *y = node->out->t.data;
    ag_chunks a = ag_chunks_of(node, s, ag_sum_chunk((int64_t)s.h * s.w, c));
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = ts_arena_zalloc(ag_arena(tape), (size_t)a.tasks * (size_t)c, sizeof(double)); /* [N][parts][C] */
    if (!part) {
        ag_fail(tape, TS_NOMEM, "channel_mean: no memory for the sums");
        return;
    }
    a.part = part;
    ts_for(ag_threads(tape), a.tasks, 1, sum_chunks, &a);
    for (int64_t i = 0; i < (int64_t)s.n * c; i++) {
        double sum = 0;
        for (int64_t t = 0; t < a.parts; t++) sum += part[(i / c * a.parts + t) * c + i % c];
        y[i] = (float)(sum / (double)a.pixels);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static void spread_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++)
        ts_elementwise_k()->broadcast(ag_chunk_count(a, t), a->c, (const float *)a->stat + ag_chunk_image(a, t) * a->c,
                                      a->dx + ag_chunk_at(a, t), a->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    ag_chunks a = ag_chunks_of(node, s, ag_pixel_chunk(s.c));
    a.dx = ag_grad_target(tape, node->in[0], &a.accumulate);
    if (!a.dx) return;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    float *each = ts_arena_alloc(ag_arena(tape), (size_t)s.n * (size_t)s.c * sizeof(float)); /* dy / P: [N][C] */
    if (!each) {
        ag_fail(tape, TS_NOMEM, "channel_mean: no memory for the gradient");
        return;
    }
    ts_elementwise_k()->scale((int64_t)s.n * s.c, (float)(1.0 / (double)a.pixels), node->out->grad, each, false);
    a.stat = each;
    ts_for(ag_threads(tape), a.tasks, 1, spread_chunks, &a);
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
