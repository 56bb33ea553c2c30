/* y = a + b,   da = db = dy */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"

#ifdef AG_API
/* a + b, of equal shapes. */
ag_value *ag_add(ag_tape *tape, ag_value *a, ag_value *b);
#endif

typedef struct adding {
    const float *a, *b;
    float *to;
} adding;

static void add_range(const void *job, int64_t begin, int64_t end)
{
    const adding *s = job;
    ts_elementwise_k()->add(end - begin, s->a + begin, s->b + begin, s->to + begin);
}

void ag_sum(ag_tape *tape, ts_shape s, const float *a, const float *b, float *to)
{
    ts_for(ag_threads(tape), ts_count(s), AG_CHUNK, add_range, &(adding){a, b, to});
}

static void forward(ag_tape *tape, ag_node *node)
{
    ag_sum(tape, node->out->t.shape, node->in[0]->t.data, node->in[1]->t.data, node->out->t.data);
}

typedef struct passing {
    const float *dy;
    float *dx;
    bool accumulate;
} passing;

static void pass_range(const void *job, int64_t begin, int64_t end)
{
    const passing *p = job;
    ts_elementwise_k()->scale(end - begin, 1.0f, p->dy + begin, p->dx + begin, p->accumulate);
}

static void pass(ag_tape *tape, const float *dy, ag_value *v)
{
    passing p = {.dy = dy};
    p.dx = ag_grad_target(tape, v, &p.accumulate);
    if (p.dx) ts_for(ag_threads(tape), ts_count(v->t.shape), AG_CHUNK, pass_range, &p);
}

void ag_grad_give(ag_tape *tape, ag_value *from, ag_value *v)
{
    if (v && !ag_grad_move(from, v)) pass(tape, from->grad, v);
}

/* One input gets dy itself where it can. */
static void backward(ag_tape *tape, ag_node *node)
{
    const float *dy = node->out->grad;
    const int moved = ag_grad_move(node->out, node->in[0]) ? 0 : ag_grad_move(node->out, node->in[1]) ? 1 : -1;
    for (int j = 0; j < 2; j++)
        if (j != moved) pass(tape, dy, node->in[j]);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    for (int64_t i = 0; i < ts_count(node->out->t.shape); i++) out[i] = in[0][i] + in[1][i];
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_add(tape, in[0], in[1]);
}

static ag_value *build_twice(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_add(tape, in[0], in[0]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 4; i++) {
        ag_case c = {.label = "random", .inputs = 2, .lo = -1, .hi = 1, .build = build};
        c.shape[0] = c.shape[1] = (ts_shape){1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 7), 1 + ts_rng_int(r, 9),
                                             1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case c = {.label = "a value added to itself",
                 .inputs = 1,
                 .shape = {{1, 3, 5, 7}},
                 .lo = -1,
                 .hi = 1,
                 .build = build_twice};
    ag_gradcheck_run(check, &c);
}

const ag_op op_add = {"add", forward, backward, reference, cases};

ag_value *ag_add(ag_tape *tape, ag_value *a, ag_value *b)
{
    ag_value *in[2] = {a, b};
    char ta[AG_SHAPE_TEXT], tb[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "add", 2, in)) return NULL;
    if (!ts_same(a->t.shape, b->t.shape))
        return ag_fail(tape, TS_INVALID, "add: shapes %s and %s differ", ag_shape_text(ta, a->t.shape),
                       ag_shape_text(tb, b->t.shape));
    return ag_apply(tape, &op_add, 2, in, a->t.shape, NULL, 0);
}
