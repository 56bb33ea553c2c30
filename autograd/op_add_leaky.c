/* u[n,p,c] = x[n,p,c] + g[n,c],   y = u > 0 ? u : leak u;   dx = y > 0 ? dy : leak dy,   dg[n,c] = sum over the pixels
 * p of dx[n,p,c]
 *
 * x, y: [N,H,W,C], g: [N,1,1,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <math.h>

#ifdef AG_API
/* leaky(x + g), g [N,1,1,C] added to every pixel of x [N,H,W,C]; 0 <= leak <= 1, 1: no activation. */
ag_value *ag_add_leaky(ag_tape *tape, ag_value *x, ag_value *g, float leak);
#endif

static float leak_of(const ag_node *node) { return *(const float *)node->attr; }

static void forward_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        const int64_t at = ag_chunk_at(a, t);
        ts_elementwise_k()->add_leaky(ag_chunk_count(a, t), a->c, a->node->in[0]->t.data + at,
                                      a->node->in[1]->t.data + ag_chunk_image(a, t) * a->c, leak_of(a->node),
                                      a->node->out->t.data + at);
    }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    const ag_chunks a = ag_chunks_of(node, s, ag_pixel_chunk(s.c));
    ts_for(ag_threads(tape), a.tasks, 1, forward_chunks, &a);
}

static void backward_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        const int64_t at = ag_chunk_at(a, t);
        ts_elementwise_k()->add_leaky_backward(ag_chunk_count(a, t), a->c, a->node->out->t.data + at,
                                               a->node->out->grad + at, leak_of(a->node), a->dx ? a->dx + at : NULL,
                                               a->accumulate, a->part ? (double *)a->part + t * a->c : NULL);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    const int c = s.c;
    ag_chunks a = ag_chunks_of(node, s, ag_sum_chunk((int64_t)s.h * s.w, c));
    bool g_accumulate;
    a.dx = ag_grad_target(tape, node->in[0], &a.accumulate);
    float *dg = ag_grad_target(tape, node->in[1], &g_accumulate);
    if (!a.dx && !dg) return;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = ts_arena_zalloc(ag_arena(tape), (size_t)a.tasks * (size_t)c, sizeof(double)); /* [N][parts][C] */
    if (!part) {
        ag_fail(tape, TS_NOMEM, "add_leaky: no memory for the sums");
        return;
    }
    if (dg) a.part = part;
    ts_for(ag_threads(tape), a.tasks, 1, backward_chunks, &a);
    for (int64_t i = 0; dg && i < (int64_t)s.n * c; i++) {
        double sum = 0;
        for (int64_t t = 0; t < a.parts; t++) sum += part[(i / c * a.parts + t) * c + i % c];
        dg[i] = (float)(g_accumulate ? dg[i] + sum : sum);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    for (int64_t i = 0; i < ts_count(s); i++) {
        double u = in[0][i] + in[1][i / ((int64_t)s.h * s.w * s.c) * s.c + i % s.c];
        out[i] = u > 0 ? u : leak_of(node) * u;
    }
}

typedef struct add_case {
    ts_shape shape;
    float leak;
} add_case;

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_add_leaky(tape, in[0], in[1], ((const add_case *)user)->leak);
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    const add_case *k = user;
    const int64_t pixels = (int64_t)k->shape.h * k->shape.w;
    const int c = k->shape.c;
    if (k->leak == 1) return false;
    if (input == 0) return fabs(in[0][i] + in[1][i / (pixels * c) * c + i % c]) <= step;
    for (int64_t p = 0; p < pixels; p++)
        if (fabs(in[0][(i / c * pixels + p) * c + i % c] + in[1][i]) <= step) return true;
    return false;
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 7; i++) {
        const add_case k = {i == 6 ? (ts_shape){1, 49, 48, 7}
                                   : (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 6), 1 + ts_rng_int(r, 6),
                                                1 + ts_rng_int(r, 33)},
                            i % 3   ? 0.2f
                                : i ? 1.0f
                                    : 0.01f};
        ag_case c = {.label = i == 6 ? "several chunks" : "random",
                     .inputs = 2,
                     .lo = -1,
                     .hi = 1,
                     .kink = kink,
                     .build = build,
                     .user = &k,
                     .shape = {k.shape, {k.shape.n, 1, 1, k.shape.c}}};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_add_leaky = {"add_leaky", forward, backward, reference, cases};

ag_value *ag_add_leaky(ag_tape *tape, ag_value *x, ag_value *g, float leak)
{
    ag_value *in[2] = {x, g};
    char tx[AG_SHAPE_TEXT], tg[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "add_leaky", 2, in)) return NULL;
    const ts_shape s = x->t.shape;
    if (!ts_same(g->t.shape, (ts_shape){s.n, 1, 1, s.c}))
        return ag_fail(tape, TS_INVALID, "add_leaky: %s cannot be added to every pixel of %s",
                       ag_shape_text(tg, g->t.shape), ag_shape_text(tx, s));
    if (!(leak >= 0 && leak <= 1))
        return ag_fail(tape, TS_INVALID, "add_leaky: leak is %g, it must lie in [0, 1]", (double)leak);
    return ag_apply(tape, &op_add_leaky, 2, in, s, &leak, sizeof leak);
}
