/* u[n,i,j,o] = bias[o] + sum_{ky,kx,c} x[n, i + d (ky - K/2), j + d (kx - K/2), c] weight[o,c,ky,kx],   y = u > 0 ? u : leak u
 * du = y > 0 ? dy : leak dy, then dx, dweight and dbias as in tensor/conv.h
 * x: [N,H,W,I], weight: {O,I,K,K}, bias: [1,1,1,O], y: [N,H,W,O] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/conv.h"
#include "tensor/kernels/elementwise.h"

#ifdef AG_API
/* Same-size convolution of x [N,H,W,ic] with weight {oc,ic,k,k}, bias [1,1,1,oc] or NULL, and a leaky ReLU: [N,H,W,oc].
 * leak in (0, 1]; 1: no activation. dilation 1 or 2. */
ag_value *ag_conv(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias, int dilation, ts_pad pad, float leak);
#endif

typedef struct conv_attr {
    ts_conv conv;
    float leak;
} conv_attr;

static void forward(ag_tape *tape, ag_node *node)
{
    const conv_attr *a = node->attr;
    const ts_conv_use use = ts_conv_precision() == TS_BF16 ? TS_CONV_FORWARD_BF16
                            : ts_conv_exact() || !ts_conv_winograd(&a->conv) ? TS_CONV_FORWARD : TS_CONV_WINOGRAD;
    const float *packed = ag_packed(tape, &a->conv, use, node->in[1]->t.data);
    if (!packed) return;
    const float *bias = node->in[2] ? node->in[2]->t.data : NULL;
    (use == TS_CONV_FORWARD_BF16 ? ts_conv_forward_bf16 : use == TS_CONV_FORWARD ? ts_conv_forward : ts_conv_forward_winograd)(&a->conv, node->in[0]->t.data, packed, bias, a->leak, node->out->t.data);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const conv_attr *a = node->attr;
    float *dy = node->out->grad;
    if (a->leak != 1.0f) { /* in place: nobody reads this gradient afterwards */
        const struct ts_elementwise_kernels *k = ts_elementwise_k();
        const float *y = node->out->t.data;
        const int64_t n = ts_count(node->out->t.shape);
        #pragma omp parallel for num_threads(ts_threads()) schedule(static) if (n > AG_CHUNK)
        for (int64_t i = 0; i < n; i += AG_CHUNK) k->leaky_backward(ag_part(n, i, AG_CHUNK), y + i, dy + i, a->leak, dy + i, false);
    }
    float *dweight = ag_grad_add(tape, node->in[1]), *dbias = ag_grad_add(tape, node->in[2]);
    if (dweight || dbias) ts_conv_weight_gradient(&a->conv, node->in[0]->t.data, dy, dweight, dbias);
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    const bool bf16 = ts_conv_precision() == TS_BF16;
    const float *packed = dx ? ag_packed(tape, &a->conv, bf16 ? TS_CONV_DATA_GRADIENT_BF16 : TS_CONV_DATA_GRADIENT, node->in[1]->t.data) : NULL;
    if (packed) (bf16 ? ts_conv_data_gradient_bf16 : ts_conv_data_gradient)(&a->conv, dy, packed, dx, accumulate);
}

/* Where a tap falls; -1: on a zero. */
static int place(int at, int size, ts_pad pad)
{
    if (at >= 0 && at < size) return at;
    return pad == TS_PAD_ZERO ? -1 : at < 0 ? 0 : size - 1;
}

/* u of one output value */
static double plain(const ts_conv *c, const double *const *in, int n, int i, int j, int o)
{
    double s = in[2] ? in[2][o] : 0;
    for (int ky = 0; ky < c->k; ky++)
        for (int kx = 0; kx < c->k; kx++) {
            const int y = place(i + c->dilation * (ky - c->k / 2), c->h, c->pad), x = place(j + c->dilation * (kx - c->k / 2), c->w, c->pad);
            if (y < 0 || x < 0) continue;
            for (int q = 0; q < c->ic; q++)
                s += in[0][((int64_t)(n * c->h + y) * c->w + x) * c->ic + q] * in[1][((o * c->ic + q) * c->k + ky) * c->k + kx];
        }
    return s;
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const conv_attr *a = node->attr;
    const ts_conv *c = &a->conv;
    for (int n = 0; n < c->n; n++)
        for (int i = 0; i < c->h; i++)
            for (int j = 0; j < c->w; j++)
                for (int o = 0; o < c->oc; o++, out++) {
                    double u = plain(c, in, n, i, j, o);
                    *out = u > 0 ? u : a->leak * u;
                }
}

typedef struct conv_case {
    conv_attr attr;
    bool bias;
} conv_case;

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const conv_case *c = user;
    return ag_conv(tape, in[0], in[1], c->bias ? in[2] : NULL, c->attr.conv.dilation, c->attr.conv.pad, c->attr.leak);
}

/* u is linear in each value alone: it crosses 0 within the step when its signs at both ends differ. */
static bool kink(const double *const *in, int input, int64_t at, double step, const void *user)
{
    const conv_case *k = user;
    const ts_conv *c = &k->attr.conv;
    if (k->attr.leak == 1.0f) return false;
    const double *moved[3] = {in[0], in[1], k->bias ? in[2] : NULL};
    double *value = (double *)(uintptr_t)(in[input] + at), was = *value; /* the checker's own array, restored below */
    bool crossed = false;
    for (int64_t q = 0; !crossed && q < (int64_t)c->n * c->h * c->w * c->oc; q++) {
        const int o = (int)(q % c->oc), j = (int)(q / c->oc % c->w), i = (int)(q / c->oc / c->w % c->h), n = (int)(q / c->oc / c->w / c->h);
        *value = was - step;
        double low = plain(c, moved, n, i, j, o);
        *value = was + step;
        double high = plain(c, moved, n, i, j, o);
        crossed = low != high && low * high <= 0;
    }
    *value = was;
    return crossed;
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    static const struct { const char *label; int h, w, ic, oc, k, dilation; ts_pad pad; } edge[] = {
        {"one pixel, 5x5, replicate", 1, 1, 3, 4, 5, 1, TS_PAD_REPLICATE}, {"one pixel, 3x3, zero", 1, 1, 2, 3, 3, 1, TS_PAD_ZERO},
        {"one row, dilated", 1, 9, 4, 2, 3, 2, TS_PAD_REPLICATE},          {"narrower than the kernel, dilated", 3, 2, 1, 1, 5, 2, TS_PAD_ZERO},
        {"18 channels, 1x1", 3, 4, 18, 5, 1, 1, TS_PAD_ZERO},              {"3x3 to 9 channels, replicate", 5, 4, 7, 9, 3, 1, TS_PAD_REPLICATE},
    };
    const int edges = (int)(sizeof edge / sizeof *edge);
    for (int t = 0; t < edges + 8; t++) {
        conv_case k = {.bias = t % 3 != 0};
        k.attr.leak = t % 2 ? 0.2f : 1.0f;
        if (t < edges) k.attr.conv = (ts_conv){1 + t % 2, edge[t].h, edge[t].w, edge[t].ic, edge[t].oc, edge[t].k, edge[t].dilation, edge[t].pad};
        else k.attr.conv = (ts_conv){1 + ts_rng_int(r, 2), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 6), 1 + ts_rng_int(r, 8), 1 + ts_rng_int(r, 8),
                                     1 + 2 * ts_rng_int(r, 3), 1 + ts_rng_int(r, 2), ts_rng_int(r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE};
        const ts_conv *v = &k.attr.conv;
        ag_case c = {.label = t < edges ? edge[t].label : "random", .inputs = k.bias ? 3 : 2, .lo = -1, .hi = 1, .kink = kink, .build = build, .user = &k,
                     .shape = {{v->n, v->h, v->w, v->ic}, {v->oc, v->ic, v->k, v->k}, {1, 1, 1, v->oc}}};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_conv = {"conv", forward, backward, reference, cases};

ag_value *ag_conv(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias, int dilation, ts_pad pad, float leak)
{
    ag_value *in[3] = {x, weight, bias};
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "conv", 2, in)) return NULL;
    const ts_shape s = x->t.shape, w = weight->t.shape; /* w: n = oc, h = ic, w = c = k */
    if (w.w != w.c) return ag_fail(tape, TS_INVALID, "conv: weight %s is not {oc,ic,k,k}", ag_shape_text(text, w));
    if (s.c != w.h) return ag_fail(tape, TS_INVALID, "conv: input has %d channels, weight wants %d", s.c, w.h);
    if (bias && !ts_same(bias->t.shape, (ts_shape){1, 1, 1, w.n}))
        return ag_fail(tape, TS_INVALID, "conv: bias %s is not [1,1,1,%d]", ag_shape_text(text, bias->t.shape), w.n);
    if (!(leak > 0 && leak <= 1)) return ag_fail(tape, TS_INVALID, "conv: leak is %g, it must lie in (0, 1]", (double)leak);
    const conv_attr a = {{s.n, s.h, s.w, s.c, w.n, w.c, dilation, pad}, leak};
    ts_status st = {0};
    if (ts_conv_check(&a.conv, &st) != TS_OK) return ag_fail(tape, st.code, "%s", st.message);
    return ag_apply(tape, &op_conv, 3, in, (ts_shape){s.n, s.h, s.w, w.n}, &a, sizeof a);
}
