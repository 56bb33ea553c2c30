/* Mean |maps - target| over all values (render/losses.h). */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include <math.h>

extern const ag_op op_map_loss;

ag_value *ag_map_loss(ag_tape *tape, ag_value *maps, ag_value *target)
{
    ag_value *in[2] = {maps, target};
    if (!ag_ready(tape, "map_loss", 2, in)) return NULL;
    char text[2][AG_SHAPE_TEXT];
    if (!ts_same(maps->t.shape, target->t.shape))
        return ag_fail(tape, TS_INVALID, "map_loss: maps %s and target %s differ in shape",
                       ag_shape_text(text[0], maps->t.shape), ag_shape_text(text[1], target->t.shape));
    if (target->needs_grad) return ag_fail(tape, TS_INVALID, "map_loss: target has no gradient here; detach it");
    return ag_apply(tape, &op_map_loss, 2, in, (ts_shape){1, 1, 1, 1}, NULL, 0);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const float *a = node->in[0]->t.data, *b = node->in[1]->t.data;
    int64_t count = ts_count(node->in[0]->t.shape), chunks = (count + AG_CHUNK - 1) / AG_CHUNK;
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)chunks * sizeof *sums), sum = 0;
    if (!sums) {
        ag_fail(tape, TS_NOMEM, "map_loss: no memory for %lld sums", (long long)chunks);
        return;
    }
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (chunks > 1)
    for (int64_t k = 0; k < chunks; k++) {
        int64_t first = k * AG_CHUNK, last = first + ag_part(count, first, AG_CHUNK);
        double part = 0;
        for (int64_t i = first; i < last; i++) part += fabs((double)a[i] - (double)b[i]);
        sums[k] = part;
    }
    for (int64_t k = 0; k < chunks; k++) sum += sums[k];
    node->out->t.data[0] = (float)(sum / (double)count);
}

static void backward(ag_tape *tape, ag_node *node)
{
    bool add;
    float *to = ag_grad_target(tape, node->in[0], &add);
    if (!to) return;
    const float *a = node->in[0]->t.data, *b = node->in[1]->t.data;
    int64_t count = ts_count(node->in[0]->t.shape);
    float up = (float)((double)node->out->grad[0] / (double)count);
#pragma omp parallel for num_threads(ag_threads(tape)) schedule(static) if (count > AG_CHUNK)
    for (int64_t i = 0; i < count; i++) {
        float g = a[i] > b[i] ? up : a[i] < b[i] ? -up : 0;
        to[i] = add ? to[i] + g : g;
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    int64_t count = ts_count(node->in[0]->t.shape);
    double sum = 0;
    for (int64_t i = 0; i < count; i++) sum += fabs(in[0][i] - in[1][i]);
    out[0] = sum / (double)count;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    (void)input, (void)user;
    return fabs(in[0][i] - in[1][i]) <= step;
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_map_loss(tape, in[0], in[1]);
}

static void cases(ag_gradcheck *g)
{
    static const ts_shape shapes[] = {{1, 1, 1, 1}, {2, 3, 5, 9}, {1, 64, 33, 9}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {.label = i ? "images" : "one value",
                     .inputs = 2,
                     .shape = {shapes[i], shapes[i]},
                     .fixed = {false, true},
                     .lo = -1.5f,
                     .hi = 1.5f,
                     .kink = kink,
                     .build = build};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_map_loss = {
    .name = "map_loss", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
