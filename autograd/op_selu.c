/* y = s (x > 0 ? x : a (e^x - 1)),   dx = dy (y > 0 ? s : y + s a);   s, a: TS_SELU_SCALE, TS_SELU_ALPHA
 * Klambauer et al., "Self-Normalizing Neural Networks", NIPS 2017, equation 2 */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <math.h>

#ifdef AG_API
/* SELU(x) of every value; any shape. */
ag_value *ag_selu(ag_tape *tape, ag_value *x);
#endif

static void forward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    ts_elementwise_k()->selu(end - begin, node->in[0]->t.data + begin, node->out->t.data + begin);
}

static void forward(ag_tape *tape, ag_node *node)
{
    ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, forward_range, node);
}

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    ts_elementwise_k()->selu_backward(end - begin, b->node->out->t.data + begin, b->node->out->grad + begin,
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
    for (int64_t i = 0; i < ts_count(node->out->t.shape); i++)
        out[i] = TS_SELU_SCALE * (in[0][i] > 0 ? in[0][i] : TS_SELU_ALPHA * expm1(in[0][i]));
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_selu(tape, in[0]);
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    (void)user;
    return fabs(in[input][i]) <= step;
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 6; i++) {
        ag_case c = {.label = "random", .inputs = 1, .lo = -3, .hi = 3, .kink = kink, .build = build};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case tiny = {.label = "near zero",
                    .inputs = 1,
                    .shape = {{1, 1, 3, 5}},
                    .lo = 1e-3f,
                    .hi = 1e-2f,
                    .kink = kink,
                    .build = build};
    ag_gradcheck_run(check, &tiny);
    ag_case far = {.label = "far from zero",
                   .inputs = 1,
                   .shape = {{2, 1, 1, 19}},
                   .lo = -12,
                   .hi = 12,
                   .kink = kink,
                   .build = build};
    ag_gradcheck_run(check, &far);
}

const ag_op op_selu = {"selu", forward, backward, reference, cases};

ag_value *ag_selu(ag_tape *tape, ag_value *x)
{
    if (!ag_ready(tape, "selu", 1, &x)) return NULL;
    return ag_apply(tape, &op_selu, 1, &x, x->t.shape, NULL, 0);
}
