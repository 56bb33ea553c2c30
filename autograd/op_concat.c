/* y[n,h,w,:] = a[n,h,w,:] followed by b[n,h,w,:];   da, db = their channels of dy
 * a: [N,H,W,A], b: [N,H,W,B], y: [N,H,W,A+B] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"

#ifdef AG_API
/* a [N,H,W,A] and b [N,H,W,B] side by side: [N,H,W,A+B]. */
ag_value *ag_concat(ag_tape *tape, ag_value *a, ag_value *b);
#endif

typedef struct joining {
    const ag_value *a, *b;
    float *to;
} joining;

static void join_pixels(const void *job, int64_t begin, int64_t end)
{
    const joining *j = job;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const int ca = j->a->t.shape.c, cb = j->b->t.shape.c, c = ca + cb;
    k->copy(end - begin, ca, j->a->t.data + begin * ca, ca, j->to + begin * c, c, false);
    k->copy(end - begin, cb, j->b->t.data + begin * cb, cb, j->to + begin * c + ca, c, false);
}

void ag_join(ag_tape *tape, const ag_value *a, const ag_value *b, float *to)
{
    ts_for(ag_threads(tape), ts_pixels(a->t.shape), ag_pixel_chunk(a->t.shape.c + b->t.shape.c), join_pixels,
           &(joining){a, b, to});
}

static void forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    ag_join(tape, node->in[0], node->in[1], node->out->t.data);
}

static void backward_pixels(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const int c = b->node->out->t.shape.c, m = b->node->in[b->input]->t.shape.c;
    const float *dy = b->node->out->grad + (b->input ? b->node->in[0]->t.shape.c : 0);
    ts_elementwise_k()->copy(end - begin, m, dy + begin * c, c, b->dx + begin * m, m, b->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    for (int j = 0; j < 2; j++) {
        ag_back b = {.node = node, .input = j};
        b.dx = ag_grad_target(tape, node->in[j], &b.accumulate);
        if (b.dx) ts_for(ag_threads(tape), ts_pixels(s), ag_pixel_chunk(s.c), backward_pixels, &b);
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const int a = node->in[0]->t.shape.c, b = node->in[1]->t.shape.c;
    for (int64_t p = 0; p < ts_pixels(node->out->t.shape); p++)
        for (int i = 0; i < a + b; i++) *out++ = i < a ? in[0][p * a + i] : in[1][p * b + i - a];
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_concat(tape, in[0], in[1]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 6; i++) {
        ag_case c = {.label = "random", .inputs = 2, .lo = -1, .hi = 1, .build = build};
        c.shape[0] = c.shape[1] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                             1 + ts_rng_int(r, 33)};
        c.shape[1].c = 1 + ts_rng_int(r, 20);
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_concat = {"concat", forward, backward, reference, cases};

ag_value *ag_concat(ag_tape *tape, ag_value *a, ag_value *b)
{
    ag_value *in[2] = {a, b};
    char ta[AG_SHAPE_TEXT], tb[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "concat", 2, in)) return NULL;
    ts_shape s = a->t.shape, q = b->t.shape;
    if (s.n != q.n || s.h != q.h || s.w != q.w)
        return ag_fail(tape, TS_INVALID, "concat: %s and %s differ in more than the channels", ag_shape_text(ta, s),
                       ag_shape_text(tb, q));
    s.c += q.c;
    return ag_apply(tape, &op_concat, 2, in, s, NULL, 0);
}
