/* y[p,:] = x[p, first .. first + C'-1];   dx = dy in those channels, 0 in the others
 * x: [N,H,W,C], y: [N,H,W,C'] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <string.h>

#ifdef AG_API
/* count channels of x [N,H,W,C] from first on: [N,H,W,count]. */
ag_value *ag_channels(ag_tape *tape, ag_value *x, int first, int count);
#endif

static int first_of(const ag_node *node) { return *(const int *)node->attr; }

static void forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const int first = first_of(node);
    const int c = node->in[0]->t.shape.c, d = node->out->t.shape.c;
    const int64_t pixels = ts_pixels(node->out->t.shape), chunk = ag_pixel_chunk(c);
    const float *x = node->in[0]->t.data;
    float *y = node->out->t.data;
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (pixels > chunk)
    for (int64_t p = 0; p < pixels; p += chunk)
        k->copy(ag_part(pixels, p, chunk), d, x + p * c + first, c, y + p * d, d, false);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const int first = first_of(node);
    const int c = node->in[0]->t.shape.c, d = node->out->t.shape.c;
    const int64_t pixels = ts_pixels(node->out->t.shape), chunk = ag_pixel_chunk(c);
    const float *dy = node->out->grad;
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[0], &accumulate);
    if (!dx) return;
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (pixels > chunk)
    for (int64_t p = 0; p < pixels; p += chunk) {
        const int64_t part = ag_part(pixels, p, chunk);
        if (!accumulate) memset(dx + p * c, 0, sizeof *dx * (size_t)(part * c));
        k->copy(part, d, dy + p * d, d, dx + p * c + first, c, true);
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const int c = node->in[0]->t.shape.c, d = node->out->t.shape.c;
    for (int64_t q = 0; q < ts_count(node->out->t.shape); q++) out[q] = in[0][q / d * c + first_of(node) + q % d];
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const int *range = user;
    return ag_channels(tape, in[0], range[0], range[1]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 5; i++) {
        const ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 6), 1 + ts_rng_int(r, 6), 1 + ts_rng_int(r, 12)};
        const int first = i ? ts_rng_int(r, s.c) : 0, range[2] = {first, i ? 1 + ts_rng_int(r, s.c - first) : s.c};
        ag_case c = {
            .label = i ? "random" : "all", .inputs = 1, .shape = {s}, .lo = -1, .hi = 1, .build = build, .user = range};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_channels = {"channels", forward, backward, reference, cases};

ag_value *ag_channels(ag_tape *tape, ag_value *x, int first, int count)
{
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "channels", 1, &x)) return NULL;
    ts_shape s = x->t.shape;
    if (first < 0 || count < 1 || count > s.c - first)
        return ag_fail(tape, TS_INVALID, "channels: %s has no channels %d to %d", ag_shape_text(text, s), first,
                       first + count - 1);
    s.c = count;
    return ag_apply(tape, &op_channels, 1, &x, s, &first, sizeof first);
}
