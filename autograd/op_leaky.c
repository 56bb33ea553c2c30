/* y = x > 0 ? x : leak x                                          (leaky ReLU; the identity for leak = 1)
 * dx = y > 0 ? dy : leak dy */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <math.h>

#ifdef AG_API
/* leaky(x) = x > 0 ? x : leak x, 0 <= leak <= 1; any shape. */
ag_value *ag_leaky(ag_tape *tape, ag_value *x, float leak);
#endif

static float leak_of(const ag_node *node) { return *(const float *)node->attr; }

static void forward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    ts_elementwise_k()->leaky(end - begin, node->in[0]->t.data + begin, leak_of(node), node->out->t.data + begin);
}

static void forward(ag_tape *tape, ag_node *node)
{
    ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, forward_range, node);
}

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    ts_elementwise_k()->leaky_backward(end - begin, b->node->out->t.data + begin, b->node->out->grad + begin,
                                       leak_of(b->node), b->dx + begin, b->accumulate);
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
        out[i] = in[0][i] > 0 ? in[0][i] : leak_of(node) * in[0][i];
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_leaky(tape, in[0], *(const float *)user);
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    return *(const float *)user != 1 && fabs(in[input][i]) <= step;
}

static void cases(ag_gradcheck *check)
{
    static const float leaks[] = {0.2f, 0.01f, 0.0f, 1.0f};
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 8; i++) {
        ag_case c = {
            .label = "random", .inputs = 1, .lo = -1, .hi = 1, .kink = kink, .build = build, .user = &leaks[i % 4]};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case c = {.label = "one value",
                 .inputs = 1,
                 .shape = {{1, 1, 1, 1}},
                 .lo = -2,
                 .hi = -1,
                 .build = build,
                 .user = &leaks[0]};
    ag_gradcheck_run(check, &c);
}

const ag_op op_leaky = {"leaky", forward, backward, reference, cases};

ag_value *ag_leaky(ag_tape *tape, ag_value *x, float leak)
{
    if (!ag_ready(tape, "leaky", 1, &x)) return NULL;
    if (!(leak >= 0 && leak <= 1))
        return ag_fail(tape, TS_INVALID, "leaky: leak is %g, it must lie in [0, 1]", (double)leak);
    return ag_apply(tape, &op_leaky, 1, &x, x->t.shape, &leak, sizeof leak);
}
