/* y[n,i,j,:] = x[n, y0+i, x0+j, :];   dx = dy inside the window, 0 elsewhere
 * x: [N,H,W,C], y: [N,h,w,C] */
#include "autograd/op.h"
#include "autograd/gradcheck.h"
#include "ops.h"
#include <string.h>

#ifdef AG_API
/* Rows y0 .. y0+h-1 and columns x0 .. x0+w-1 of x [N,H,W,C]: [N,h,w,C]. */
ag_value *ag_crop(ag_tape *tape, ag_value *x, int y0, int x0, int h, int w);
#endif

typedef struct attributes {
    int y0, x0;
} attributes;

static void forward_rows(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const attributes *a = node->attr;
    const ts_shape s = node->in[0]->t.shape, d = node->out->t.shape;
    const int64_t row = (int64_t)d.w * d.c;
    const float *x = node->in[0]->t.data + ((int64_t)a->y0 * s.w + a->x0) * s.c;
    float *y = node->out->t.data;
    for (int64_t i = begin; i < end; i++)
        memcpy(y + i * row, x + (i / d.h * s.h + i % d.h) * s.w * s.c, (size_t)row * sizeof(float));
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape d = node->out->t.shape;
    ts_for(ag_threads(tape), (int64_t)d.n * d.h, ag_pixel_chunk(d.w * d.c), forward_rows, node);
}

static void backward_rows(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const attributes *a = b->node->attr;
    const ts_shape s = b->node->in[0]->t.shape, d = b->node->out->t.shape;
    const int64_t row = (int64_t)s.w * s.c, left = (int64_t)a->x0 * s.c, width = (int64_t)d.w * s.c;
    for (int64_t i = begin; i < end; i++) {
        const int64_t y = i % s.h - a->y0;
        float *to = b->dx + i * row;
        if (!b->accumulate) memset(to, 0, (size_t)row * sizeof(float));
        if (y < 0 || y >= d.h) continue;
        const float *from = b->node->out->grad + (i / s.h * d.h + y) * width;
        for (int64_t j = 0; j < width; j++) to[left + j] += from[j];
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), (int64_t)s.n * s.h, ag_pixel_chunk(s.w * s.c), backward_rows, &b);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const attributes *a = node->attr;
    const ts_shape s = node->in[0]->t.shape, d = node->out->t.shape;
    for (int64_t q = 0; q < ts_count(d); q++) {
        const int64_t c = q % d.c, j = q / d.c % d.w, i = q / d.c / d.w % d.h, n = q / d.c / d.w / d.h;
        out[q] = in[0][((n * s.h + a->y0 + i) * s.w + a->x0 + j) * s.c + c];
    }
}

typedef struct place {
    int y0, x0, h, w;
} place;

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const place *p = user;
    return ag_crop(tape, in[0], p->y0, p->x0, p->h, p->w);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 6; i++) {
        const ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 9), 1 + ts_rng_int(r, 9), 1 + ts_rng_int(r, 12)};
        place p = {.h = i ? 1 + ts_rng_int(r, s.h) : s.h, .w = i ? 1 + ts_rng_int(r, s.w) : s.w};
        p.y0 = ts_rng_int(r, s.h - p.h + 1);
        p.x0 = ts_rng_int(r, s.w - p.w + 1);
        ag_case c = {.label = i ? "random" : "all of it",
                     .inputs = 1,
                     .shape = {s},
                     .lo = -1,
                     .hi = 1,
                     .build = build,
                     .user = &p};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_crop = {"crop", forward, backward, reference, cases};

ag_value *ag_crop(ag_tape *tape, ag_value *x, int y0, int x0, int h, int w)
{
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "crop", 1, &x)) return NULL;
    const ts_shape s = x->t.shape;
    if (h < 1 || w < 1 || y0 < 0 || x0 < 0 || h > s.h - y0 || w > s.w - x0)
        return ag_fail(tape, TS_INVALID, "crop: rows %d + %d and columns %d + %d are not inside %s", y0, h, x0, w,
                       ag_shape_text(text, s));
    const attributes a = {y0, x0};
    return ag_apply(tape, &op_crop, 1, &x, (ts_shape){s.n, h, w, s.c}, &a, sizeof a);
}
