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

static void forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const float *x = node->in[0]->t.data;
    float *y = node->out->t.data;
    const int64_t n = ts_count(node->out->t.shape);
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (n > AG_CHUNK)
    for (int64_t i = 0; i < n; i += AG_CHUNK) k->tanh(ag_part(n, i, AG_CHUNK), x + i, y + i);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const float *y = node->out->t.data, *dy = node->out->grad;
    const int64_t n = ts_count(node->out->t.shape);
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (!dx) return;
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (n > AG_CHUNK)
    for (int64_t i = 0; i < n; i += AG_CHUNK)
        k->tanh_backward(ag_part(n, i, AG_CHUNK), y + i, dy + i, dx + i, accumulate);
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
