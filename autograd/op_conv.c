/* u[n,i,j,o] = bias[o] + base[n,i,j,o] + sum_{ky,kx,c} x[n, i + d (ky - K/2), j + d (kx - K/2), c] weight[o,c,ky,kx],
 * y = u > 0 ? u : leak u;   du = y > 0 ? dy : leak dy, then dx, dweight and dbias as in tensor/conv/conv.h, dbase = du
 * x: [N,H,W,I], or its first channels, and the others as constants; weight: {O,I,K,K}, bias: [1,1,1,O], y and base:
 * [N,H,W,O] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/conv/conv.h"
#include "tensor/kernels/elementwise.h"

#ifdef AG_API
/* Same-size convolution of x [N,H,W,ic] with weight {oc,ic,k,k}, bias [1,1,1,oc] or NULL, and a leaky ReLU: [N,H,W,oc].
 * leak in (0, 1]; 1: no activation. dilation 1 or 2. */
ag_value *ag_conv(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias, int dilation, ts_pad pad, float leak);
/* The same of x [N,H,W,i] and, behind its channels, constants [N,H,W,ic-i], which get no gradient, and for which none
 * is computed: an error if they want one. NULL: of x alone. */
ag_value *ag_conv_with_constants(ag_tape *tape, ag_value *x, ag_value *constants, ag_value *weight, ag_value *bias,
                                 int dilation, ts_pad pad, float leak);
/* base [N,H,W,oc] + the convolution of x, without an activation; ag_into base: in its place. */
ag_value *ag_conv_add(ag_tape *tape, ag_value *base, ag_value *x, ag_value *weight, ag_value *bias, int dilation,
                      ts_pad pad);
#endif

enum { X, WEIGHT, BIAS, CONSTANTS, BASE, INPUTS };

typedef struct conv_attr {
    ts_conv conv;
    float leak;
} conv_attr;

/* All channels of the input, in the arena where constants join it. */
static const float *input(ag_tape *tape, const ag_node *node)
{
    const ag_value *x = node->in[X], *constants = node->in[CONSTANTS];
    if (!constants) return x->t.data;
    ts_shape s = x->t.shape;
    s.c += constants->t.shape.c;
    float *both = ts_new(ag_arena(tape), s).data;
    if (both) ag_join(tape, x, constants, both);
    else ag_fail(tape, TS_NOMEM, "conv: no memory for %lld values", (long long)ts_count(s));
    return both;
}

/* Whether backward reads the input's channels joined. */
static bool saves(const ag_tape *tape, const ag_node *node)
{
    const conv_attr *a = node->attr;
    return ag_gradients(tape) && node->in[WEIGHT]->needs_grad && !ts_conv_joins(&a->conv, TS_CONV_WEIGHTS);
}

static void weight_gradient(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight, float *dbias)
{
    const ts_conv_way way = dweight ? ts_conv_choose(c, TS_CONV_WEIGHTS) : TS_CONV_DIRECTLY;
    const bool winograd = way == TS_CONV_BY_WINOGRAD, bf16 = dweight && ts_conv_rounds_weights(c);
    if (winograd) (bf16 ? ts_conv_weight_gradient_winograd_bf16 : ts_conv_weight_gradient_winograd)(c, in, dy, dweight);
    else if (bf16) ts_conv_weight_gradient_bf16(c, in, dy, dweight);
    ts_conv_weight_gradient(c, in->x, dy, winograd || bf16 ? NULL : dweight, dbias);
}

typedef void forward_function(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y);
static forward_function *const forwards[TS_CONV_USES] = {[TS_CONV_FORWARD] = ts_conv_forward,
                                                         [TS_CONV_WINOGRAD] = ts_conv_forward_winograd,
                                                         [TS_CONV_FORWARD_BF16] = ts_conv_forward_bf16,
                                                         [TS_CONV_WINOGRAD_BF16] = ts_conv_forward_winograd_bf16};

typedef void data_gradient_function(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate);
static data_gradient_function *const data_gradients[TS_CONV_USES] = {
    [TS_CONV_DATA_GRADIENT] = ts_conv_data_gradient,
    [TS_CONV_DATA_GRADIENT_WINOGRAD] = ts_conv_data_gradient_winograd,
    [TS_CONV_DATA_GRADIENT_BF16] = ts_conv_data_gradient_bf16,
    [TS_CONV_DATA_GRADIENT_WINOGRAD_BF16] = ts_conv_data_gradient_winograd_bf16};

static const float *data(const ag_value *v) { return v ? v->t.data : NULL; }

/* Where a convolution's way adds no base, its result is made apart. */
static void run(ag_tape *tape, const conv_attr *a, ts_conv_inputs in, const float *packed, ag_value *out)
{
    forward_function *const forward = forwards[ts_conv_packing(&a->conv, TS_CONV_OUTPUT)];
    if (!in.base || ts_conv_adds(&a->conv)) {
        forward(&a->conv, &in, packed, a->leak, out->t.data);
        return;
    }
    float *change = ts_new(ag_arena(tape), out->t.shape).data;
    const float *base = in.base;
    in.base = NULL;
    if (!change) {
        ag_fail(tape, TS_NOMEM, "conv: no memory for %lld values", (long long)ts_count(out->t.shape));
        return;
    }
    forward(&a->conv, &in, packed, 1, change);
    ag_sum(tape, out->t.shape, base, change, out->t.data);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const conv_attr *a = node->attr;
    const ts_conv_use use = ts_conv_packing(&a->conv, TS_CONV_OUTPUT);
    if (ag_traced()) ag_trace_way(tape, ts_conv_way_name(ts_conv_choose(&a->conv, TS_CONV_OUTPUT)));
    ts_mark mark = ts_arena_mark(ag_arena(tape));
    ts_conv_inputs in = {.x = data(node->in[X]), .bias = data(node->in[BIAS]), .base = data(node->in[BASE])};
    const bool saved = saves(tape, node);
    if (!saved && ts_conv_joins(&a->conv, TS_CONV_OUTPUT)) in.constants = data(node->in[CONSTANTS]);
    else in.x = input(tape, node);
    if (saved) {
        node->saved = (void *)(uintptr_t)in.x;
        mark = ts_arena_mark(ag_arena(tape));
    }
    const float *packed = ag_packed(tape, &a->conv, use, node->in[WEIGHT]->t.data);
    if (in.x && packed) run(tape, a, in, packed, node->out);
    ts_arena_release(ag_arena(tape), mark);
}

static void leaky_range(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const conv_attr *a = node->attr;
    float *dy = node->out->grad + begin;
    ts_elementwise_k()->leaky_backward(end - begin, node->out->t.data + begin, dy, a->leak, dy, false);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const conv_attr *a = node->attr;
    float *dy = node->out->grad;
    if (a->leak != 1.0f) /* in place: nobody reads this gradient afterwards */
        ts_for(ag_threads(tape), ts_count(node->out->t.shape), AG_CHUNK, leaky_range, node);
    float *dweight = ag_grad_add(tape, node->in[WEIGHT]), *dbias = ag_grad_add(tape, node->in[BIAS]);
    ts_conv_inputs in = {.x = node->saved};
    if (!in.x) in = (ts_conv_inputs){.x = data(node->in[X]), .constants = data(node->in[CONSTANTS])};
    if (dweight || dbias) weight_gradient(&a->conv, &in, dy, dweight, dbias);
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[X], &accumulate);
    const ts_conv_use use = ts_conv_packing(&a->conv, TS_CONV_INPUT);
    if (dx && ag_traced()) ag_trace_way(tape, ts_conv_way_name(ts_conv_choose(&a->conv, TS_CONV_INPUT)));
    const float *packed = dx ? ag_packed(tape, &a->conv, use, node->in[WEIGHT]->t.data) : NULL;
    if (packed) data_gradients[use](&a->conv, dy, packed, dx, accumulate);
    ag_grad_give(tape, node->out, node->in[BASE]);
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
    const int variables = ts_conv_variables(c);
    double s = in[BIAS] ? in[BIAS][o] : 0;
    for (int ky = 0; ky < c->k; ky++)
        for (int kx = 0; kx < c->k; kx++) {
            const int y = place(i + c->dilation * (ky - c->k / 2), c->h, c->pad),
                      x = place(j + c->dilation * (kx - c->k / 2), c->w, c->pad);
            if (y < 0 || x < 0) continue;
            const int64_t pixel = (int64_t)(n * c->h + y) * c->w + x;
            for (int q = 0; q < c->ic; q++)
                s += (q < variables ? in[X][pixel * variables + q]
                                    : in[CONSTANTS][pixel * c->constants + q - variables]) *
                    in[WEIGHT][((o * c->ic + q) * c->k + ky) * c->k + kx];
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
                    if (in[BASE]) u += in[BASE][((int64_t)(n * c->h + i) * c->w + j) * c->oc + o];
                    *out = u > 0 ? u : a->leak * u;
                }
}

typedef struct conv_case {
    conv_attr attr;
    bool bias, base;
} conv_case;

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const conv_case *c = user;
    const ts_conv *v = &c->attr.conv;
    if (c->base) return ag_conv_add(tape, in[BASE], in[X], in[WEIGHT], c->bias ? in[BIAS] : NULL, v->dilation, v->pad);
    return ag_conv_with_constants(tape, in[X], v->constants ? in[CONSTANTS] : NULL, in[WEIGHT],
                                  c->bias ? in[BIAS] : NULL, v->dilation, v->pad, c->attr.leak);
}

/* u is linear in each value alone: it crosses 0 within the step when its signs at both ends differ. */
static bool kink(const double *const *in, int input, int64_t at, double step, const void *user)
{
    const conv_case *k = user;
    const ts_conv *c = &k->attr.conv;
    if (k->attr.leak == 1.0f) return false;
    const double *moved[INPUTS] = {in[X], in[WEIGHT], k->bias ? in[BIAS] : NULL, c->constants ? in[CONSTANTS] : NULL};
    double *value = (double *)(uintptr_t)(in[input] + at), was = *value; /* the checker's own array, restored below */
    bool crossed = false;
    for (int64_t q = 0; !crossed && q < (int64_t)c->n * c->h * c->w * c->oc; q++) {
        const int o = (int)(q % c->oc), j = (int)(q / c->oc % c->w), i = (int)(q / c->oc / c->w % c->h),
                  n = (int)(q / c->oc / c->w / c->h);
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
    static const struct {
        const char *label;
        int h, w, ic, oc, k, dilation;
        ts_pad pad;
    } edge[] = {
        {"one pixel, 5x5, replicate", 1, 1, 3, 4, 5, 1, TS_PAD_REPLICATE},
        {"one pixel, 3x3, zero", 1, 1, 2, 3, 3, 1, TS_PAD_ZERO},
        {"one row, dilated", 1, 9, 4, 2, 3, 2, TS_PAD_REPLICATE},
        {"narrower than the kernel, dilated", 3, 2, 1, 1, 5, 2, TS_PAD_ZERO},
        {"18 channels, 1x1", 3, 4, 18, 5, 1, 1, TS_PAD_ZERO},
        {"3x3 to 9 channels, replicate", 5, 4, 7, 9, 3, 1, TS_PAD_REPLICATE},
        {"3x3, Winograd's tiles", 16, 32, 16, 16, 3, 1, TS_PAD_REPLICATE},
    };
    const int edges = (int)(sizeof edge / sizeof *edge);
    for (int t = 0; t < edges + 8; t++) {
        conv_case k = {.bias = t % 3 != 0};
        k.attr.leak = t % 2 ? 0.2f : 1.0f;
        if (t < edges)
            k.attr.conv = (ts_conv){1 + t % 2, edge[t].h,        edge[t].w,   edge[t].ic, edge[t].oc,
                                    edge[t].k, edge[t].dilation, edge[t].pad, 0,          {0}};
        else
            k.attr.conv = (ts_conv){1 + ts_rng_int(r, 2),
                                    1 + ts_rng_int(r, 5),
                                    1 + ts_rng_int(r, 6),
                                    1 + ts_rng_int(r, 8),
                                    1 + ts_rng_int(r, 8),
                                    1 + 2 * ts_rng_int(r, 3),
                                    1 + ts_rng_int(r, 2),
                                    ts_rng_int(r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE,
                                    0,
                                    {0}};
        ts_conv *v = &k.attr.conv;
        v->constants = t % 4 == 1 ? v->ic / 2 : 0;
        k.base = t % 4 == 2; /* without constants and activation */
        ag_case c = {.label = t < edges ? edge[t].label : "random",
                     .inputs = k.base   ? INPUTS
                         : v->constants ? BASE
                         : k.bias       ? CONSTANTS
                                        : BIAS,
                     .lo = -1,
                     .hi = 1,
                     .kink = kink,
                     .build = build,
                     .user = &k,
                     .shape = {{v->n, v->h, v->w, ts_conv_variables(v)},
                               {v->oc, v->ic, v->k, v->k},
                               {1, 1, 1, v->oc},
                               {v->n, v->h, v->w, v->constants ? v->constants : 1},
                               {v->n, v->h, v->w, v->oc}}};
        c.fixed[CONSTANTS] = true;
        c.fixed[BIAS] = !k.bias;
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_conv = {"conv", forward, backward, reference, cases};

static ag_value *convolve(ag_tape *tape, ag_value *const in[INPUTS], int dilation, ts_pad pad, float leak)
{
    ag_value *x = in[X], *weight = in[WEIGHT], *bias = in[BIAS], *constants = in[CONSTANTS], *base = in[BASE];
    char text[AG_SHAPE_TEXT], more[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "conv", BIAS, in)) return NULL;
    ts_shape s = x->t.shape, w = weight->t.shape; /* w: n = oc, h = ic, w = c = k */
    if (constants) {
        const ts_shape q = constants->t.shape;
        if (q.n != s.n || q.h != s.h || q.w != s.w)
            return ag_fail(tape, TS_INVALID, "conv: %s and %s differ in more than the channels", ag_shape_text(text, s),
                           ag_shape_text(more, q));
        if (constants->needs_grad)
            return ag_fail(tape, TS_INVALID, "conv: the constants behind the input have no gradient");
        s.c += q.c;
    }
    if (w.w != w.c) return ag_fail(tape, TS_INVALID, "conv: weight %s is not {oc,ic,k,k}", ag_shape_text(text, w));
    if (s.c != w.h) return ag_fail(tape, TS_INVALID, "conv: input has %d channels, weight wants %d", s.c, w.h);
    if (bias && !ts_same(bias->t.shape, (ts_shape){1, 1, 1, w.n}))
        return ag_fail(tape, TS_INVALID, "conv: bias %s is not [1,1,1,%d]", ag_shape_text(text, bias->t.shape), w.n);
    if (!(leak > 0 && leak <= 1))
        return ag_fail(tape, TS_INVALID, "conv: leak is %g, it must lie in (0, 1]", (double)leak);
    const conv_attr a = {{s.n, s.h, s.w, s.c, w.n, w.c, dilation, pad, s.c - x->t.shape.c, *ag_compute(tape)}, leak};
    ts_status st = {0};
    if (ts_conv_check(&a.conv, &st) != TS_OK) return ag_fail(tape, st.code, "%s", st.message);
    const ts_shape y = {s.n, s.h, s.w, w.n};
    if (base && !ts_same(base->t.shape, y))
        return ag_fail(tape, TS_INVALID, "conv: %s is added to %s, which differs", ag_shape_text(text, y),
                       ag_shape_text(more, base->t.shape));
    return ag_apply(tape, &op_conv, INPUTS, in, y, &a, sizeof a);
}

ag_value *ag_conv_with_constants(ag_tape *tape, ag_value *x, ag_value *constants, ag_value *weight, ag_value *bias,
                                 int dilation, ts_pad pad, float leak)
{
    return convolve(tape, (ag_value *[INPUTS]){x, weight, bias, constants}, dilation, pad, leak);
}

ag_value *ag_conv_add(ag_tape *tape, ag_value *base, ag_value *x, ag_value *weight, ag_value *bias, int dilation,
                      ts_pad pad)
{
    if (!ag_ready(tape, "conv", 1, &base)) return NULL;
    return convolve(tape, (ag_value *[INPUTS]){x, weight, bias, NULL, base}, dilation, pad, 1);
}

ag_value *ag_conv(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias, int dilation, ts_pad pad, float leak)
{
    return ag_conv_with_constants(tape, x, NULL, weight, bias, dilation, pad, leak);
}
