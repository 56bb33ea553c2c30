/* ih = x W_ih' + b_ih,  hh = old W_hh' + b_hh,  z = sigmoid(ih_z + hh_z),  r = sigmoid(ih_r + hh_r),  m = tanh(ih_n + r
 * hh_n), y = (1 - z) old + z m; its gradients as in tensor/kernels/elementwise.h and tensor/conv/gru.h, where the
 * source is named
 *
 * x: [N,H,W,I], old: [N,H,W,C] or NULL = 0, W_ih: {3C,I,1,1}, W_hh: {3C,C,1,1} in chunks z, r, n,
 * biases: [1,1,1,3C], y: [N,H,W,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/conv/gru.h"
#include <math.h>

#ifdef AG_API
/* The new state [N,H,W,C] of a gated recurrent unit whose gates are 1 x 1 convolutions: of x [N,H,W,I] with ih
 * {3C,I,1,1}, of old [N,H,W,C] (NULL: a state of zeros) with hh {3C,C,1,1}; biases [1,1,1,3C]; chunks z, r, n. */
ag_value *ag_gru(ag_tape *tape, ag_value *x, ag_value *old, ag_value *ih, ag_value *ih_bias, ag_value *hh,
                 ag_value *hh_bias);
#endif

enum { X, IH, IH_BIAS, HH, HH_BIAS, OLD, INPUTS };

static ts_gru shape(ts_compute how, const ag_node *node)
{
    return (ts_gru){ts_pixels(node->out->t.shape), node->in[X]->t.shape.c, node->out->t.shape.c,
                    how.precision == TS_BF16, how.threads};
}

static const float *packed(ag_tape *tape, ts_conv c, ts_conv_use use, const ag_value *weight)
{
    return ag_packed(tape, &c, use, weight->t.data);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_gru g = shape(*(const ts_compute *)node->attr, node);
    const ts_conv_use use = g.bf16 ? TS_CONV_FORWARD_BF16 : TS_CONV_FORWARD;
    const float *ih = packed(tape, ts_gru_input(&g), use, node->in[IH]),
                *old = node->in[OLD] ? node->in[OLD]->t.data : NULL;
    const float *hh = ih && old ? packed(tape, ts_gru_hidden(&g), use, node->in[HH]) : NULL;
    if (!ih || (old && !hh)) return;
    if (node->out->needs_grad) {
        node->saved = ts_arena_alloc(ag_arena(tape), (size_t)g.pixels * 4 * (size_t)g.c * sizeof(float));
        if (!node->saved) {
            ag_fail(tape, TS_NOMEM, "gru: no memory for the gates");
            return;
        }
    }
    ts_gru_forward(&g, node->in[X]->t.data, old, ih, node->in[IH_BIAS]->t.data, hh, node->in[HH_BIAS]->t.data,
                   node->out->t.data, node->saved);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_gru g = shape(*(const ts_compute *)node->attr, node);
    const float *old = node->in[OLD] ? node->in[OLD]->t.data : NULL;
    ts_gru_gradients to = {0};
    /* The state first: it may be x itself. */
    to.dold = ag_grad_target(tape, node->in[OLD], &to.dold_add);
    to.dx = ag_grad_target(tape, node->in[X], &to.dx_add);
    to.ih_weight = ag_grad_add(tape, node->in[IH]);
    to.ih_bias = ag_grad_add(tape, node->in[IH_BIAS]);
    to.hh_weight = ag_grad_add(tape, node->in[HH]);
    to.hh_bias = ag_grad_add(tape, node->in[HH_BIAS]);
    const ts_conv_use use = ts_gru_backward_bf16(&g) ? TS_CONV_DATA_GRADIENT_BF16 : TS_CONV_DATA_GRADIENT;
    const float *ih = to.dx ? packed(tape, ts_gru_input(&g), use, node->in[IH]) : NULL;
    const float *hh = to.dold ? packed(tape, ts_gru_hidden(&g), use, node->in[HH]) : NULL;
    if (ag_status(tape)->code) return;
    ts_gru_backward(&g, node->in[X]->t.data, old, ih, hh, node->saved, node->out->grad, &to);
}

static double gate(const double *weight, const double *bias, int row, int channels, const double *x)
{
    double sum = bias[row];
    for (int i = 0; x && i < channels; i++) sum += weight[row * channels + i] * x[i];
    return sum;
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_gru g = shape((ts_compute){0}, node);
    for (int64_t p = 0; p < g.pixels; p++)
        for (int i = 0; i < g.c; i++) {
            const double *x = in[X] + p * g.ic, *old = in[OLD] ? in[OLD] + p * g.c : NULL;
            double a[3], b[3];
            for (int k = 0; k < 3; k++) {
                a[k] = gate(in[IH], in[IH_BIAS], k * g.c + i, g.ic, x);
                b[k] = gate(in[HH], in[HH_BIAS], k * g.c + i, g.c, old);
            }
            const double z = 1 / (1 + exp(-a[0] - b[0])), r = 1 / (1 + exp(-a[1] - b[1])), m = tanh(a[2] + r * b[2]);
            out[p * g.c + i] = (old ? (1 - z) * old[i] : 0) + z * m;
        }
}

/* user: what the state is */
enum { STATE_NONE, STATE_GIVEN, STATE_X };

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const int state = *(const int *)user;
    return ag_gru(tape, in[X], state == STATE_NONE ? NULL : in[state == STATE_X ? X : OLD], in[IH], in[IH_BIAS], in[HH],
                  in[HH_BIAS]);
}

static ag_case make_case(const char *label, ts_shape s, int ic, const int *state)
{
    ag_case c = {.label = label,
                 .inputs = *state == STATE_GIVEN ? INPUTS : OLD,
                 .lo = -1,
                 .hi = 1,
                 .build = build,
                 .user = state};
    c.shape[X] = (ts_shape){s.n, s.h, s.w, ic};
    c.shape[IH] = (ts_shape){3 * s.c, ic, 1, 1};
    c.shape[HH] = (ts_shape){3 * s.c, s.c, 1, 1};
    c.shape[IH_BIAS] = c.shape[HH_BIAS] = (ts_shape){1, 1, 1, 3 * s.c};
    c.shape[OLD] = s;
    return c;
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    static const char *const labels[] = {"no state", "state", "the state is x"};
    for (int t = 0; t < 9; t++) {
        const int state = t % 3;
        const ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 5),
                            1 + ts_rng_int(r, t < 6 ? 6 : 35)};
        const ag_case c = make_case(labels[state], s, state == STATE_X ? s.c : 1 + ts_rng_int(r, 20), &state);
        ag_gradcheck_run(check, &c);
    }
    const int state = STATE_GIVEN;
    ag_case big = make_case("several parts", (ts_shape){1, 47, 46, 3}, 5, &state);
    ag_gradcheck_run(check, &big);
}

const ag_op op_gru = {"gru", forward, backward, reference, cases};

ag_value *ag_gru(ag_tape *tape, ag_value *x, ag_value *old, ag_value *ih, ag_value *ih_bias, ag_value *hh,
                 ag_value *hh_bias)
{
    ag_value *in[INPUTS] = {x, ih, ih_bias, hh, hh_bias, old};
    char a[AG_SHAPE_TEXT], b[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "gru", OLD, in)) return NULL;
    ts_shape s = x->t.shape;
    const int gates = ih->t.shape.n;
    if (gates % 3 || !ts_same(ih->t.shape, (ts_shape){gates, s.c, 1, 1}))
        return ag_fail(tape, TS_INVALID, "gru: ih is %s for %d input channels, not {3c,ic,1,1}",
                       ag_shape_text(a, ih->t.shape), s.c);
    s.c = gates / 3;
    if (!ts_same(hh->t.shape, (ts_shape){gates, s.c, 1, 1}))
        return ag_fail(tape, TS_INVALID, "gru: hh is %s for a state of %d channels, not {3c,c,1,1}",
                       ag_shape_text(a, hh->t.shape), s.c);
    if (!ts_same(ih_bias->t.shape, (ts_shape){1, 1, 1, gates}) ||
        !ts_same(hh_bias->t.shape, (ts_shape){1, 1, 1, gates}))
        return ag_fail(tape, TS_INVALID, "gru: the biases are %s and %s, not [1,1,1,%d]",
                       ag_shape_text(a, ih_bias->t.shape), ag_shape_text(b, hh_bias->t.shape), gates);
    if (old && !ts_same(old->t.shape, s))
        return ag_fail(tape, TS_INVALID, "gru: the state is %s, not %s", ag_shape_text(b, old->t.shape),
                       ag_shape_text(a, s));
    return ag_apply(tape, &op_gru, INPUTS, in, s, ag_compute(tape), sizeof(ts_compute));
}
