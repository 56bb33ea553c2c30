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

static void forward_pixels(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const int c = node->in[0]->t.shape.c, d = node->out->t.shape.c;
    ts_elementwise_k()->copy(end - begin, d, node->in[0]->t.data + begin * c + first_of(node), c,
                             node->out->t.data + begin * d, d, false);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ts_for(ag_threads(tape), ts_pixels(s), ag_pixel_chunk(node->in[0]->t.shape.c), forward_pixels, node);
}

static void backward_pixels(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const int c = b->node->in[0]->t.shape.c, d = b->node->out->t.shape.c;
    enum { NEAR = 256 }; /* pixels whose zeros are in the first cache when their gradient comes */
    for (int64_t p = begin; p < end; p += NEAR) {
        const int64_t count = ag_part(end, p, NEAR);
        float *dx = b->dx + p * c;
        if (!b->accumulate) memset(dx, 0, sizeof *dx * (size_t)(count * c));
        ts_elementwise_k()->copy(count, d, b->node->out->grad + p * d, d, dx + first_of(b->node), c, b->accumulate);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx)
        ts_for(ag_threads(tape), ts_pixels(node->out->t.shape), ag_pixel_chunk(node->in[0]->t.shape.c), backward_pixels,
               &b);
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
