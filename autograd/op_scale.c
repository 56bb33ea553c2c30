/* y = s x,   dx = s dy */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"

#ifdef AG_API
/* s x, with a constant s; any shape. */
ag_value *ag_scale(ag_tape *tape, ag_value *x, float s);
#endif

static float factor(const ag_node *node) { return *(const float *)node->attr; }

static void forward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    ts_elementwise_k()->scale(end - begin, factor(node), node->in[0]->t.data + begin, node->out->t.data + begin, false);
}

static void forward(ag_tape *tape, ag_node *node)
{
    ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, forward_range, node);
}

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    ts_elementwise_k()->scale(end - begin, factor(b->node), b->node->out->grad + begin, b->dx + begin, b->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, backward_range, &b);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    for (int64_t i = 0; i < ts_count(node->out->t.shape); i++) out[i] = factor(node) * in[0][i];
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_scale(tape, in[0], *(const float *)user);
}

static void cases(ag_gradcheck *check)
{
    static const float factors[] = {-1.5f, 1.0f, 1e5f, 0.0f};
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 4; i++) {
        ag_case c = {.label = "random", .inputs = 1, .lo = -1, .hi = 1, .build = build, .user = &factors[i]};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_scale = {"scale", forward, backward, reference, cases};

ag_value *ag_scale(ag_tape *tape, ag_value *x, float s)
{
    if (!ag_ready(tape, "scale", 1, &x)) return NULL;
    return ag_apply(tape, &op_scale, 1, &x, x->t.shape, &s, sizeof s);
}
