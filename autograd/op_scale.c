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

static void forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const float s = factor(node), *x = node->in[0]->t.data;
    float *y = node->out->t.data;
    const int64_t n = ts_count(node->out->t.shape);
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (n > AG_CHUNK)
    for (int64_t i = 0; i < n; i += AG_CHUNK) k->scale(ag_part(n, i, AG_CHUNK), s, x + i, y + i, false);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const float s = factor(node), *dy = node->out->grad;
    const int64_t n = ts_count(node->out->t.shape);
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (!dx) return;
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (n > AG_CHUNK)
    for (int64_t i = 0; i < n; i += AG_CHUNK) k->scale(ag_part(n, i, AG_CHUNK), s, dy + i, dx + i, accumulate);
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
