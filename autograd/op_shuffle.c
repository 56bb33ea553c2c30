/* y[n,i,j,(a r + b) C + c] = x[n, i r + a, j r + b, c] (space to depth), or its inverse (depth to space), plus what is
 * added, of y's shape;   dx: the other of the two on dy, dadded = dy   x: [N,H,W,C], y: [N,H/r,W/r,C r r], or the other
 * way round */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include <string.h>

#ifdef AG_API
/* Squares of r x r pixels of x [N,H,W,C] become one with their channels side by side: [N,H/r,W/r,C r r]. H and W are
 * multiples of r. */
ag_value *ag_space_to_depth(ag_tape *tape, ag_value *x, int r);
/* The inverse: [N,H,W,C r r] to [N,H r,W r,C]; the second plus added, of the result's shape. */
ag_value *ag_depth_to_space(ag_tape *tape, ag_value *x, int r);
ag_value *ag_depth_to_space_add(ag_tape *tape, ag_value *x, int r, ag_value *added);
#endif

enum { X, ADDED, INPUTS };

typedef struct shuffle_attr {
    int r;
    bool deep; /* space to depth */
} shuffle_attr;

/* large: [N,H,W,C]; deep: its pixels are those of small [N,H/r,W/r,C r r]. */
typedef struct moving {
    ts_shape large;
    int r;
    bool to_deep;
    const float *from, *added; /* added: NULL, or of to's shape; may be to */
    float *to;
} moving;

static void move_rows(const void *job, int64_t begin, int64_t end)
{
    const moving *m = job;
    const int64_t run = (int64_t)m->r * m->large.c, row = (int64_t)m->large.w * m->large.c;
    const int across = m->large.w / m->r;
    for (int64_t y = begin; y < end; y++) {
        const int64_t deep = y / m->r * across * run * m->r + y % m->r * run;
        for (int x = 0; x < across; x++) {
            const int64_t a = y * row + x * run, b = deep + x * run * m->r;
            const float *s = m->from + (m->to_deep ? a : b);
            float *d = m->to + (m->to_deep ? b : a);
            const float *more = m->added ? m->added + (m->to_deep ? b : a) : NULL;
            if (!more) memcpy(d, s, (size_t)run * sizeof *d);
            else
                for (int64_t i = 0; i < run; i++) d[i] = s[i] + more[i];
        }
    }
}

static void move(int threads, const moving *m)
{
    ts_for(threads, (int64_t)m->large.n * m->large.h, ag_pixel_chunk(m->large.w * m->large.c), move_rows, m);
}

static moving of(const ag_node *node)
{
    const shuffle_attr *a = node->attr;
    return (moving){.large = a->deep ? node->in[X]->t.shape : node->out->t.shape, .r = a->r, .to_deep = a->deep};
}

static void forward(ag_tape *tape, ag_node *node)
{
    moving m = of(node);
    m.from = node->in[X]->t.data;
    m.added = node->in[ADDED] ? node->in[ADDED]->t.data : NULL;
    m.to = node->out->t.data;
    move(ag_threads(tape), &m);
}

static void backward(ag_tape *tape, ag_node *node)
{
    bool accumulate;
    float *dx = ag_grad_target(tape, node->in[X], &accumulate);
    if (dx) {
        moving m = of(node);
        m.to_deep = !m.to_deep;
        m.from = node->out->grad;
        m.added = accumulate ? dx : NULL;
        m.to = dx;
        move(ag_threads(tape), &m);
    }
    ag_grad_give(tape, node->out, node->in[ADDED]);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const shuffle_attr *a = node->attr;
    const ts_shape s = a->deep ? node->in[0]->t.shape : node->out->t.shape,
                   d = a->deep ? node->out->t.shape : node->in[0]->t.shape;
    for (int64_t q = 0; q < ts_count(s); q++) {
        const int64_t c = q % s.c, j = q / s.c % s.w, i = q / s.c / s.w % s.h, n = q / s.c / s.w / s.h;
        const int64_t p = ((n * d.h + i / a->r) * d.w + j / a->r) * d.c + (i % a->r * a->r + j % a->r) * s.c + c;
        if (a->deep) out[p] = in[X][q];
        else out[q] = in[X][p] + (node->in[ADDED] ? in[ADDED][q] : 0);
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const shuffle_attr *a = user;
    return (a->deep ? ag_space_to_depth : ag_depth_to_space)(tape, in[X], a->r);
}

static ag_value *build_sum(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_depth_to_space_add(tape, in[X], ((const shuffle_attr *)user)->r, in[ADDED]);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 12; i++) {
        const shuffle_attr a = {1 + ts_rng_int(r, 4), i < 8 && i % 2 == 0};
        const bool sum = i >= 8;
        ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 4), 1 + ts_rng_int(r, 4), 1 + ts_rng_int(r, 5)};
        if (a.deep) s.h *= a.r, s.w *= a.r;
        else s.c *= a.r * a.r;
        ag_case c = {.label = a.deep ? "space to depth"
                         : sum       ? "depth to space, and a sum"
                                     : "depth to space",
                     .inputs = sum ? INPUTS : ADDED,
                     .shape = {s, {s.n, s.h * a.r, s.w * a.r, s.c / (a.r * a.r)}},
                     .lo = -1,
                     .hi = 1,
                     .build = sum ? build_sum : build,
                     .user = &a};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_shuffle = {"shuffle", forward, backward, reference, cases};

ag_value *ag_space_to_depth(ag_tape *tape, ag_value *x, int r)
{
    ag_value *in[INPUTS] = {x};
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "space_to_depth", ADDED, in)) return NULL;
    const ts_shape s = x->t.shape;
    if (r < 1 || s.h % r || s.w % r)
        return ag_fail(tape, TS_INVALID, "space_to_depth: %s is not of squares of %d", ag_shape_text(text, s), r);
    const shuffle_attr a = {r, true};
    return ag_apply(tape, &op_shuffle, INPUTS, in, (ts_shape){s.n, s.h / r, s.w / r, s.c * r * r}, &a, sizeof a);
}

static ag_value *to_space(ag_tape *tape, int r, int inputs, ag_value *const in[INPUTS])
{
    char text[AG_SHAPE_TEXT], more[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "depth_to_space", inputs, in)) return NULL;
    const ts_shape s = in[X]->t.shape;
    if (r < 1 || (int64_t)s.c % ((int64_t)r * r))
        return ag_fail(tape, TS_INVALID, "depth_to_space: %s has not a multiple of %lld channels",
                       ag_shape_text(text, s), (long long)r * r);
    const shuffle_attr a = {r, false};
    const ts_shape out = {s.n, s.h * r, s.w * r, s.c / (r * r)};
    if (in[ADDED] && !ts_same(in[ADDED]->t.shape, out))
        return ag_fail(tape, TS_INVALID, "depth_to_space: what is added is %s, not %s",
                       ag_shape_text(text, in[ADDED]->t.shape), ag_shape_text(more, out));
    return ag_apply(tape, &op_shuffle, INPUTS, in, out, &a, sizeof a);
}

ag_value *ag_depth_to_space(ag_tape *tape, ag_value *x, int r)
{
    return to_space(tape, r, ADDED, (ag_value *const[INPUTS]){x});
}

ag_value *ag_depth_to_space_add(ag_tape *tape, ag_value *x, int r, ag_value *added)
{
    return to_space(tape, r, INPUTS, (ag_value *const[INPUTS]){x, added});
}
