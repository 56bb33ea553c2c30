/* y = x's first C channels, and (y_3, y_4) += s f - t (f turned by a quarter), f = p / (p.p + 0.05), where p is the
 * pixel's place (x right, y up) in half widths from the centre and (s, t) are x's channels C and C + 1;   dx = dy, ds =
 * f.(dy_3, dy_4), dt likewise. Under a flash near the camera a photograph shows of the normal what it has along p, and
 * shows p.n: f, p's regularised inverse, is what leads from there to the normal, so that layers that know no places
 * can. x: [N,S,S,C+2], y: [N,S,S,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include "tensor/maps.h"
#include <string.h>

extern const ag_op op_shading_frame;

#define REGULAR 0.05

/* Of column j and row i. */
static void frame(int i, int j, int side, double f[2])
{
    const double x = (2 * (double)j + 1) / side - 1, y = 1 - (2 * (double)i + 1) / side;
    const double inverse = 1 / (x * x + y * y + REGULAR);
    f[0] = x * inverse;
    f[1] = y * inverse;
}

/* The square's row that is x's first. */
static int top_of(const ag_node *node) { return *(const int *)node->attr; }

/* The next pixel's row and column. */
static void next(ts_shape s, int *i, int *j)
{
    if (++*j < s.w) return;
    *j = 0;
    if (++*i == s.h) *i = 0;
}

static void forward_pixels(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const ts_shape s = node->out->t.shape;
    float *y = node->out->t.data;
    const int top = top_of(node);
    int i = (int)(begin / s.w % s.h), j = (int)(begin % s.w);
    for (int64_t p = begin; p < end; p++, next(s, &i, &j)) {
        const float *from = node->in[0]->t.data + p * (s.c + 2);
        double f[2];
        frame(top + i, j, s.w, f);
        memcpy(y + p * s.c, from, (size_t)s.c * sizeof *y);
        y[p * s.c + MAP_NORMAL] += from[s.c] * (float)f[0] - from[s.c + 1] * (float)f[1];
        y[p * s.c + MAP_NORMAL + 1] += from[s.c] * (float)f[1] + from[s.c + 1] * (float)f[0];
    }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ts_for(ag_threads(tape), ts_pixels(s), ag_pixel_chunk(s.c), forward_pixels, node);
}

static void backward_pixels(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const ts_shape s = b->node->out->t.shape;
    const int top = top_of(b->node);
    int i = (int)(begin / s.w % s.h), j = (int)(begin % s.w);
    for (int64_t p = begin; p < end; p++, next(s, &i, &j)) {
        const float *from = b->node->out->grad + p * s.c;
        float *to = b->dx + p * (s.c + 2);
        double f[2];
        frame(top + i, j, s.w, f);
        if (!b->accumulate) memset(to, 0, (size_t)(s.c + 2) * sizeof *to);
        for (int c = 0; c < s.c; c++) to[c] += from[c];
        to[s.c] += from[MAP_NORMAL] * (float)f[0] + from[MAP_NORMAL + 1] * (float)f[1];
        to[s.c + 1] += from[MAP_NORMAL + 1] * (float)f[0] - from[MAP_NORMAL] * (float)f[1];
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), ts_pixels(s), ag_pixel_chunk(s.c), backward_pixels, &b);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    for (int64_t p = 0; p < ts_pixels(s); p++) {
        const double *from = in[0] + p * (s.c + 2);
        double f[2];
        frame(top_of(node) + (int)(p / s.w % s.h), (int)(p % s.w), s.w, f);
        for (int i = 0; i < s.c; i++) out[p * s.c + i] = from[i];
        out[p * s.c + MAP_NORMAL] += from[s.c] * f[0] - from[s.c + 1] * f[1];
        out[p * s.c + MAP_NORMAL + 1] += from[s.c] * f[1] + from[s.c + 1] * f[0];
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const int *top = user;
    return ag_shading_frame(tape, in[0], *top);
}

static void cases(ag_gradcheck *check)
{
    static const ts_shape shapes[] = {{1, 1, 1, 11}, {2, 5, 5, 11}, {1, 8, 8, 12}, {2, 3, 8, 11}};
    static int tops[] = {0, 0, 0, 4};
    static const char *const labels[] = {"the centre alone", "images", "more channels", "some rows"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {
            .label = labels[i], .inputs = 1, .shape = {shapes[i]}, .lo = -1, .hi = 1, .build = build, .user = &tops[i]};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_shading_frame = {
    .name = "shading_frame", .forward = forward, .backward = backward, .reference = reference, .cases = cases};

ag_value *ag_shading_frame(ag_tape *tape, ag_value *x, int top)
{
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "shading_frame", 1, &x)) return NULL;
    ts_shape s = x->t.shape;
    if (top < 0 || s.h > s.w - top || s.c < MAP_CHANNELS + 2)
        return ag_fail(tape, TS_INVALID, "shading_frame: %s is not [N,S,S,C+2] with at least nine maps, from row %d on",
                       ag_shape_text(text, s), top);
    s.c -= 2;
    return ag_apply(tape, &op_shading_frame, 1, &x, s, &top, sizeof top);
}
