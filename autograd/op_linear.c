/* y[n,o] = bias[o] + sum_i x[n,i] weight[o,i]
 * dx[n,i] = sum_o dy[n,o] weight[o,i],   dweight[o,i] = sum_n dy[n,o] x[n,i],   dbias[o] = sum_n dy[n,o]
 * x: [N,1,1,I], weight: {1,1,O,I}, bias: [1,1,1,O], y: [N,1,1,O] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/conv/gemm.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/team.h"
#include <string.h>

#ifdef AG_API
/* x [N,1,1,in] times weight {1,1,out,in} transposed, plus bias [1,1,1,out] or NULL: [N,1,1,out]. */
ag_value *ag_linear(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias);
#endif

typedef struct rows_job {
    int64_t n, in, out;
    const float *x, *weight;
    const char *half; /* or NULL */
    float *y;
} rows_job;

static void add_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *r = job;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const int64_t rows = r->n > 1 ? 1 : end - begin; /* at once: a row of weights stays near for all of x */
    for (int64_t i = begin; i < end; i += rows)
        for (int64_t j = 0; j < r->n; j++) {
            const float *x = r->x + j * r->in;
            float *y = r->y + j * r->out + i;
            if (r->half) k->add_dots_half(rows, r->in, r->half + 2 * i * r->in, x, y);
            else k->add_dots(rows, r->in, r->weight + i * r->in, x, y);
        }
}

enum { WORTH = 1 << 14 }; /* products that another thread is worth */

static void forward(ag_tape *tape, ag_node *node)
{
    const int n = node->out->t.shape.n, o = node->out->t.shape.c, i = node->in[0]->t.shape.c;
    float *y = node->out->t.data;
    for (int j = 0; node->in[2] && j < n; j++)
        memcpy(y + (size_t)j * (size_t)o, node->in[2]->t.data, (size_t)o * sizeof(float));
    if (!node->in[2]) memset(y, 0, (size_t)n * (size_t)o * sizeof *y);
    const float *weight = node->in[1]->t.data;
    ts_for(ag_threads(tape), o, WORTH / ((int64_t)n * i) + 1, add_rows,
           &(rows_job){n, i, o, node->in[0]->t.data, weight, ag_half(tape, weight), y});
}

static void backward(ag_tape *tape, ag_node *node)
{
    const int n = node->out->t.shape.n, o = node->out->t.shape.c, i = node->in[0]->t.shape.c;
    const float *dy = node->out->grad;
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (dx)
        ts_gemm(false, false, n, i, o, 1.0f, dy, node->in[1]->t.data, accumulate ? 1.0f : 0.0f, dx, ag_threads(tape));
    float *dw = ag_grad_target(tape, node->in[1], &accumulate);
    if (dw)
        ts_gemm(true, false, o, i, n, 1.0f, dy, node->in[0]->t.data, accumulate ? 1.0f : 0.0f, dw, ag_threads(tape));
    float *db = ag_grad_add(tape, node->in[2]);
    for (int j = 0; db && j < n; j++)
        for (int q = 0; q < o; q++) db[q] += dy[(size_t)j * (size_t)o + (size_t)q];
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const int n = node->out->t.shape.n, o = node->out->t.shape.c, ic = node->in[0]->t.shape.c;
    for (int j = 0; j < n; j++)
        for (int q = 0; q < o; q++) {
            double s = in[2] ? in[2][q] : 0;
            for (int i = 0; i < ic; i++) s += in[0][j * ic + i] * in[1][q * ic + i];
            out[j * o + q] = s;
        }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_linear(tape, in[0], in[1], user ? in[2] : NULL);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int k = 0; k < 8; k++) {
        const int n = 1 + ts_rng_int(r, 9), i = k ? 1 + ts_rng_int(r, 70) : 1, o = k ? 1 + ts_rng_int(r, 40) : 1;
        ag_case c = {.label = k % 2 ? "with bias" : "without bias",
                     .inputs = k % 2 ? 3 : 2,
                     .lo = -1,
                     .hi = 1,
                     .build = build,
                     .user = k % 2 ? check : NULL,
                     .shape = {{n, 1, 1, i}, {1, 1, o, i}, {1, 1, 1, o}}};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_linear = {"linear", forward, backward, reference, cases};

ag_value *ag_linear(ag_tape *tape, ag_value *x, ag_value *weight, ag_value *bias)
{
    ag_value *in[3] = {x, weight, bias};
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "linear", 2, in)) return NULL;
    const ts_shape s = x->t.shape, w = weight->t.shape;
    if (s.h != 1 || s.w != 1)
        return ag_fail(tape, TS_INVALID, "linear: input %s is not [N,1,1,in]", ag_shape_text(text, s));
    if (w.n != 1 || w.h != 1)
        return ag_fail(tape, TS_INVALID, "linear: weight %s is not {1,1,out,in}", ag_shape_text(text, w));
    if (s.c != w.c) return ag_fail(tape, TS_INVALID, "linear: input has %d channels, weight wants %d", s.c, w.c);
    if (bias && !ts_same(bias->t.shape, (ts_shape){1, 1, 1, w.w}))
        return ag_fail(tape, TS_INVALID, "linear: bias %s is not [1,1,1,%d]", ag_shape_text(text, bias->t.shape), w.w);
    return ag_apply(tape, &op_linear, 3, in, (ts_shape){s.n, 1, 1, w.w}, NULL, 0);
}
