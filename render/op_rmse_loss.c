/* The mean over images of the RMSE of some channels, or of its square (render/losses.h). */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include <math.h>
#include <string.h>

extern const ag_op op_rmse_loss;

typedef struct range {
    int first, count;
    bool squared;
} range;

#define LEAST 1e-6 /* squared error that is as good as none: it keeps the gradient of a perfect image finite */

static ag_value *apply(ag_tape *tape, ag_value *maps, ag_value *target, int first, int count, bool squared)
{
    ag_value *in[2] = {maps, target};
    if (!ag_ready(tape, "rmse_loss", 2, in)) return NULL;
    char text[2][AG_SHAPE_TEXT];
    if (!ts_same(maps->t.shape, target->t.shape))
        return ag_fail(tape, TS_INVALID, "rmse_loss: maps %s and target %s differ in shape",
                       ag_shape_text(text[0], maps->t.shape), ag_shape_text(text[1], target->t.shape));
    if (target->needs_grad) return ag_fail(tape, TS_INVALID, "rmse_loss: target has no gradient here; detach it");
    if (first < 0 || count < 1 || first + count > maps->t.shape.c)
        return ag_fail(tape, TS_INVALID, "rmse_loss: maps %s have no %d channels from channel %d",
                       ag_shape_text(text[0], maps->t.shape), count, first);
    return ag_apply(tape, &op_rmse_loss, 2, in, (ts_shape){1, 1, 1, 1}, &(range){first, count, squared}, sizeof(range));
}

ag_value *ag_rmse_loss(ag_tape *tape, ag_value *maps, ag_value *target, int first, int count)
{
    return apply(tape, maps, target, first, count, false);
}

ag_value *ag_mse_loss(ag_tape *tape, ag_value *maps, ag_value *target, int first, int count)
{
    return apply(tape, maps, target, first, count, true);
}

typedef struct loss_job {
    const ag_node *node;
    int64_t image;
    double *row, up;
    const float *rmse;
    float *to;
    bool add;
} loss_job;

static void squares_of_rows(const void *job, int64_t begin, int64_t end)
{
    const loss_job *j = job;
    const ts_shape s = j->node->in[0]->t.shape;
    const range *r = j->node->attr;
    const float *a = j->node->in[0]->t.data, *b = j->node->in[1]->t.data;
    for (int64_t y = begin; y < end; y++) {
        const int64_t at = (j->image * s.h + y) * s.w * s.c + r->first;
        double part = 0;
        for (int64_t x = 0; x < s.w; x++)
            for (int c = 0; c < r->count; c++) {
                const double d = (double)a[at + x * s.c + c] - (double)b[at + x * s.c + c];
                part += d * d;
            }
        j->row[y] = part;
    }
}

/* The sum of squared differences of rows' parts of an image, in an order that does not depend on the threads. */
static double squares(const ag_node *node, int64_t image, int threads, double *row)
{
    const ts_shape s = node->in[0]->t.shape;
    double sum = 0;
    ts_for(threads, s.h, 1, squares_of_rows, &(loss_job){.node = node, .image = image, .row = row});
    for (int y = 0; y < s.h; y++) sum += row[y];
    return sum;
}

/* RMSE of each image, which backward divides by; NULL after an error. */
static float *rmse_of(ag_tape *tape, const ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    const double values = (double)s.h * s.w * ((const range *)node->attr)->count;
    double *row = ts_arena_alloc(ag_arena(tape), (size_t)s.h * sizeof *row);
    float *rmse = ts_arena_alloc(ag_arena(tape), (size_t)s.n * sizeof *rmse);
    if (!row || !rmse) return ag_fail(tape, TS_NOMEM, "rmse_loss: no memory for %d images", s.n), NULL;
    for (int i = 0; i < s.n; i++) rmse[i] = (float)sqrt(squares(node, i, ag_threads(tape), row) / values + LEAST);
    return rmse;
}

static void forward(ag_tape *tape, ag_node *node)
{
    const int n = node->in[0]->t.shape.n;
    const range *r = node->attr;
    const float *rmse = node->saved = rmse_of(tape, node);
    double sum = 0;
    for (int i = 0; i < n && rmse; i++) sum += (double)rmse[i] * (r->squared ? (double)rmse[i] : 1);
    node->out->t.data[0] = (float)(sum / n);
}

static void backward_rows(const void *job, int64_t begin, int64_t end)
{
    const loss_job *j = job;
    const ts_shape s = j->node->in[0]->t.shape;
    const range *r = j->node->attr;
    const float *a = j->node->in[0]->t.data, *b = j->node->in[1]->t.data;
    for (int64_t y = begin; y < end; y++) {
        const float w = (float)(r->squared ? 2 * j->up : j->up / (double)j->rmse[y / s.h]);
        const int64_t row = y * s.w * s.c;
        if (!j->add) memset(j->to + row, 0, sizeof *j->to * (size_t)(s.w * s.c));
        for (int64_t p = row + r->first; p < row + (int64_t)s.w * s.c; p += s.c)
            for (int64_t i = p; i < p + r->count; i++) j->to[i] += w * (a[i] - b[i]);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->in[0]->t.shape;
    const range *r = node->attr;
    loss_job j = {.node = node, .up = (double)node->out->grad[0] / ((double)s.n * s.h * s.w * r->count)};
    j.to = ag_grad_target(tape, node->in[0], &j.add);
    j.rmse = node->saved;
    if (j.to) ts_for(ag_threads(tape), (int64_t)s.n * s.h, 1, backward_rows, &j);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape;
    const range *r = node->attr;
    const int64_t pixels = (int64_t)s.h * s.w;
    out[0] = 0;
    for (int i = 0; i < s.n; i++) {
        double sum = 0;
        for (int64_t p = i * pixels; p < (i + 1) * pixels; p++)
            for (int c = r->first; c < r->first + r->count; c++)
                sum += (in[0][p * s.c + c] - in[1][p * s.c + c]) * (in[0][p * s.c + c] - in[1][p * s.c + c]);
        const double mean = sum / (double)(pixels * r->count) + LEAST;
        out[0] += (r->squared ? mean : sqrt(mean)) / s.n;
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const range *r = user;
    return (r->squared ? ag_mse_loss : ag_rmse_loss)(tape, in[0], in[1], r->first, r->count);
}

static void cases(ag_gradcheck *g)
{
    static const ts_shape shapes[] = {{1, 1, 1, 1}, {2, 3, 5, 9}, {3, 17, 9, 9}, {1, 1, 1, 1}, {3, 17, 9, 9}};
    static const range ranges[] = {{0, 1, false}, {3, 2, false}, {6, 3, false}, {0, 1, true}, {3, 2, true}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {.label = shapes[i].c > 1 ? "images" : "one value",
                     .inputs = 2,
                     .shape = {shapes[i], shapes[i]},
                     .fixed = {false, true},
                     .lo = -1.5f,
                     .hi = 1.5f,
                     .build = build,
                     .user = &ranges[i]};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_rmse_loss = {
    .name = "rmse_loss", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
