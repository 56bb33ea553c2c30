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

static void forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const float *x = node->in[0]->t.data;
    float *y = node->out->t.data;
    const int64_t n = ts_count(node->out->t.shape);
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (n > AG_CHUNK)
    for (int64_t i = 0; i < n; i += AG_CHUNK) k->selu(ag_part(n, i, AG_CHUNK), x + i, y + i);
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
        k->selu_backward(ag_part(n, i, AG_CHUNK), y + i, dy + i, dx + i, accumulate);
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
