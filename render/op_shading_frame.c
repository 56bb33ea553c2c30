/* y = x's first C channels, and (y_3, y_4) += s f - t (f turned by a quarter), f = p / (p.p + 0.05), where p is the
 * pixel's place (x right, y up) in half widths from the centre and (s, t) are x's channels C and C + 1;   dx = dy, ds =
 * f.(dy_3, dy_4), dt likewise. Under a flash near the camera a photograph shows of the normal what it has along p, and
 * shows p.n: f, p's regularised inverse, is what leads from there to the normal, so that layers that know no places
 * can. x: [N,S,S,>= C+2], y: [N,S,S,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/maps.h"
#include <string.h>

extern const ag_op op_shading_frame;

#define REGULAR 0.05

typedef struct frame_attr {
    int channels, top; /* C; the square's row that is x's first */
} frame_attr;

/* Of column j and row i. */
static void frame(int i, int j, int side, double f[2])
{
    const double x = (2 * (double)j + 1) / side - 1, y = 1 - (2 * (double)i + 1) / side;
    const double inverse = 1 / (x * x + y * y + REGULAR);
    f[0] = x * inverse;
    f[1] = y * inverse;
}

/* What a loop over the rows of all images is given. */
typedef struct rows {
    const ag_node *node;
    const float *from; /* y's gradient backward */
    float *to;
    int stride; /* floats of a pixel of x */
    bool accumulate;
} rows;

enum { NEAR = 64 }; /* pixels at once: what they were copied to is in the first cache when it is changed */

/* f of some pixels of a row. */
static void frames(const rows *r, int64_t row, int first, int count, float fx[NEAR], float fy[NEAR])
{
    const ts_shape s = r->node->out->t.shape;
    const int i = ((const frame_attr *)r->node->attr)->top + (int)(row % s.h);
    for (int j = 0; j < count; j++) {
        double f[2];
        frame(i, first + j, s.w, f);
        fx[j] = (float)f[0], fy[j] = (float)f[1];
    }
}

static void forward_rows(const void *job, int64_t begin, int64_t end)
{
    const rows *r = job;
    const ts_shape s = r->node->out->t.shape;
    float fx[NEAR], fy[NEAR];
    for (int64_t row = begin; row < end; row++)
        for (int first = 0; first < s.w; first += NEAR) {
            const int count = s.w - first < NEAR ? s.w - first : NEAR;
            const float *from = r->from + (row * s.w + first) * r->stride;
            float *to = r->to + (row * s.w + first) * s.c;
            frames(r, row, first, count, fx, fy);
            ts_elementwise_k()->copy(count, s.c, from, r->stride, to, s.c, false);
            for (int j = 0; j < count; j++, from += r->stride, to += s.c) {
                to[MAP_NORMAL] += from[s.c] * fx[j] - from[s.c + 1] * fy[j];
                to[MAP_NORMAL + 1] += from[s.c] * fy[j] + from[s.c + 1] * fx[j];
            }
        }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ts_for(
        ag_threads(tape), (int64_t)s.n * s.h, 1, forward_rows,
        &(rows){.node = node, .from = node->in[0]->t.data, .to = node->out->t.data, .stride = node->in[0]->t.shape.c});
}

static void backward_rows(const void *job, int64_t begin, int64_t end)
{
    const rows *r = job;
    const ts_shape s = r->node->out->t.shape;
    float fx[NEAR], fy[NEAR];
    for (int64_t row = begin; row < end; row++)
        for (int first = 0; first < s.w; first += NEAR) {
            const int count = s.w - first < NEAR ? s.w - first : NEAR;
            const float *from = r->from + (row * s.w + first) * s.c;
            float *to = r->to + (row * s.w + first) * r->stride;
            frames(r, row, first, count, fx, fy);
            if (!r->accumulate) memset(to, 0, sizeof *to * (size_t)(count * r->stride));
            ts_elementwise_k()->copy(count, s.c, from, s.c, to, r->stride, r->accumulate);
            for (int j = 0; j < count; j++, from += s.c, to += r->stride) {
                to[s.c] += from[MAP_NORMAL] * fx[j] + from[MAP_NORMAL + 1] * fy[j];
                to[s.c + 1] += from[MAP_NORMAL + 1] * fx[j] - from[MAP_NORMAL] * fy[j];
            }
        }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    rows r = {.node = node, .from = node->out->grad, .stride = node->in[0]->t.shape.c};
    r.to = ag_grad_target(tape, node->in[0], &r.accumulate);
    if (r.to) ts_for(ag_threads(tape), (int64_t)s.n * s.h, 1, backward_rows, &r);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    const int stride = node->in[0]->t.shape.c, top = ((const frame_attr *)node->attr)->top;
    for (int64_t p = 0; p < ts_pixels(s); p++) {
        const double *from = in[0] + p * stride;
        double f[2];
        frame(top + (int)(p / s.w % s.h), (int)(p % s.w), s.w, f);
        for (int i = 0; i < s.c; i++) out[p * s.c + i] = from[i];
        out[p * s.c + MAP_NORMAL] += from[s.c] * f[0] - from[s.c + 1] * f[1];
        out[p * s.c + MAP_NORMAL + 1] += from[s.c] * f[1] + from[s.c + 1] * f[0];
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const frame_attr *a = user;
    return ag_shading_frame(tape, in[0], a->channels, a->top);
}

static void cases(ag_gradcheck *check)
{
    static const ts_shape shapes[] = {{1, 1, 1, 11}, {2, 5, 5, 11}, {1, 8, 8, 12}, {2, 3, 8, 11}, {1, 2, 70, 15}};
    static const frame_attr attrs[] = {{9, 0}, {9, 0}, {10, 0}, {9, 4}, {9, 40}};
    static const char *const labels[] = {"the centre alone", "images", "more channels", "some rows", "others behind"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {.label = labels[i],
                     .inputs = 1,
                     .shape = {shapes[i]},
                     .lo = -1,
                     .hi = 1,
                     .build = build,
                     .user = &attrs[i]};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_shading_frame = {
    .name = "shading_frame", .forward = forward, .backward = backward, .reference = reference, .cases = cases};

ag_value *ag_shading_frame(ag_tape *tape, ag_value *x, int channels, int top)
{
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "shading_frame", 1, &x)) return NULL;
    ts_shape s = x->t.shape;
    if (top < 0 || s.h > s.w - top || channels < MAP_CHANNELS || s.c < channels + 2)
        return ag_fail(tape, TS_INVALID,
                       "shading_frame: %s is not [N,S,S,%d] or more, with at least nine maps and two more channels, "
                       "from row %d on",
                       ag_shape_text(text, s), channels + 2, top);
    s.c = channels;
    return ag_apply(tape, &op_shading_frame, 1, &x, s, &(frame_attr){channels, top}, sizeof(frame_attr));
}
