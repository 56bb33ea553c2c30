/* y = tanh x,   dx = dy (1 - y^2) */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <math.h>

#ifdef AG_API
/* tanh(x) of every value; any shape. */
ag_value *ag_tanh(ag_tape *tape, ag_value *x);
#endif

static void forward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    ts_elementwise_k()->tanh(end - begin, node->in[0]->t.data + begin, node->out->t.data + begin);
}

static void forward(ag_tape *tape, ag_node *node)
{
    ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, forward_range, node);
}

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    ts_elementwise_k()->tanh_backward(end - begin, b->node->out->t.data + begin, b->node->out->grad + begin,
                                      b->dx + begin, b->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, backward_range, &b);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    for (int64_t i = 0; i < ts_count(node->out->t.shape); i++) out[i] = tanh(in[0][i]);
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_tanh(tape, in[0]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 6; i++) {
        ag_case c = {.label = "random", .inputs = 1, .lo = -3, .hi = 3, .build = build};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case tiny = {
        .label = "near zero", .inputs = 1, .shape = {{1, 1, 3, 5}}, .lo = 1e-3f, .hi = 1e-2f, .build = build};
    ag_gradcheck_run(check, &tiny);
    ag_case far = {
        .label = "far from zero", .inputs = 1, .shape = {{2, 1, 1, 19}}, .lo = -12, .hi = 12, .build = build};
    ag_gradcheck_run(check, &far);
}

const ag_op op_tanh = {"tanh", forward, backward, reference, cases};

ag_value *ag_tanh(ag_tape *tape, ag_value *x)
{
    if (!ag_ready(tape, "tanh", 1, &x)) return NULL;
    return ag_apply(tape, &op_tanh, 1, &x, x->t.shape, NULL, 0);
}
