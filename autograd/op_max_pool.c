/* y[n,i,j,c] = max of x[n, 2i + {0,1}, 2j + {0,1}, c];   dy goes to the largest, to the first in reading order of equal
 * ones
 *
 * x: [N,2H,2W,C], y: [N,H,W,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/pool.h"

#ifdef AG_API
/* The largest of each 2x2 block: [N,2H,2W,C] to [N,H,W,C]; even sizes only. */
ag_value *ag_max_pool(ag_tape *tape, ag_value *x);
#endif

static void forward_lines(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const ts_shape s = node->out->t.shape;
    const float *x = node->in[0]->t.data;
    const int64_t row = 2 * (int64_t)s.w * s.c;
    for (int64_t i = begin; i < end; i++)
        ts_pool_k()->max(s.w, s.c, x + 2 * i * row, x + (2 * i + 1) * row, node->out->t.data + i * s.w * s.c);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ts_for(ag_threads(tape), (int64_t)s.n * s.h, 1, forward_lines, node);
}

static void backward_lines(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const ts_shape s = b->node->out->t.shape;
    const float *x = b->node->in[0]->t.data;
    const int64_t row = 2 * (int64_t)s.w * s.c;
    for (int64_t i = begin; i < end; i++)
        ts_pool_k()->max_backward(s.w, s.c, x + 2 * i * row, x + (2 * i + 1) * row, b->node->out->grad + i * s.w * s.c,
                                  b->dx + 2 * i * row, b->dx + (2 * i + 1) * row, b->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), (int64_t)s.n * s.h, 1, backward_lines, &b);
}

/* Value q (0 .. 3 in reading order) of the block of output value i. */
static double of_block(ts_shape s, const double *x, int64_t i, int q)
{
    const int64_t line = i / ((int64_t)s.w * s.c), at = i % ((int64_t)s.w * s.c);
    return x[(2 * line + q / 2) * 2 * s.w * s.c + (2 * (at / s.c) + q % 2) * s.c + at % s.c];
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    for (int64_t i = 0; i < ts_count(s); i++) {
        out[i] = of_block(s, in[0], i, 0);
        for (int q = 1; q < 4; q++)
            if (of_block(s, in[0], i, q) > out[i]) out[i] = of_block(s, in[0], i, q);
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_max_pool(tape, in[0]);
}

/* The value meets the largest of the other three on its way. */
static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    const ts_shape s = *(const ts_shape *)user; /* of the output */
    const int64_t row = 2 * (int64_t)s.w * s.c, line = i / row, column = i % row / s.c;
    const int64_t block = line / 2 * s.w * s.c + column / 2 * s.c + i % s.c;
    const int self = (int)(line % 2 * 2 + column % 2);
    double other = -1e300;
    for (int q = 0; q < 4; q++)
        if (q != self && of_block(s, in[input], block, q) > other) other = of_block(s, in[input], block, q);
    return in[input][i] - step <= other && other <= in[input][i] + step;
}

static void equal_pairs(float *const *in, const void *user)
{
    const ts_shape s = *(const ts_shape *)user;
    for (int64_t i = 0; i < 4 * ts_count(s); i++) in[0][i] = (float)(int)(in[0][i] * 2);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 7; i++) {
        const ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 35)};
        ag_case c = {.label = i == 6 ? "equal values" : "random",
                     .inputs = 1,
                     .lo = -1,
                     .hi = 1,
                     .kink = kink,
                     .build = build,
                     .user = &s,
                     .shape = {{s.n, 2 * s.h, 2 * s.w, s.c}},
                     .prepare = i == 6 ? equal_pairs : NULL};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_max_pool = {"max_pool", forward, backward, reference, cases};

ag_value *ag_max_pool(ag_tape *tape, ag_value *x)
{
    if (!ag_ready(tape, "max_pool", 1, &x)) return NULL;
    const ts_shape s = x->t.shape;
    if (s.h % 2 || s.w % 2)
        return ag_fail(tape, TS_INVALID, "max_pool: the image is %d x %d, both sizes must be even", s.h, s.w);
    return ag_apply(tape, &op_max_pool, 1, &x, (ts_shape){s.n, s.h / 2, s.w / 2, s.c}, NULL, 0);
}
