/* Mean of w_c |maps - target| over all values, c their channel (render/losses.h). */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

extern const ag_op op_map_loss;

/* One weight for all of a value's channels, or one for each. */
typedef struct weights {
    bool given;
    float of[MAP_CHANNELS];
} weights;

static ag_value *apply(ag_tape *tape, ag_value *maps, ag_value *target, const weights *w)
{
    ag_value *in[2] = {maps, target};
    if (!ag_ready(tape, "map_loss", 2, in)) return NULL;
    char text[2][AG_SHAPE_TEXT];
    if (!ts_same(maps->t.shape, target->t.shape))
        return ag_fail(tape, TS_INVALID, "map_loss: maps %s and target %s differ in shape",
                       ag_shape_text(text[0], maps->t.shape), ag_shape_text(text[1], target->t.shape));
    if (target->needs_grad) return ag_fail(tape, TS_INVALID, "map_loss: target has no gradient here; detach it");
    if (w->given && maps->t.shape.c != MAP_CHANNELS)
        return ag_fail(tape, TS_INVALID, "map_loss: maps %s: the weights are of nine channels",
                       ag_shape_text(text[0], maps->t.shape));
    return ag_apply(tape, &op_map_loss, 2, in, (ts_shape){1, 1, 1, 1}, w, sizeof *w);
}

ag_value *ag_map_loss(ag_tape *tape, ag_value *maps, ag_value *target, const float *weight)
{
    weights w = {.given = weight};
    if (weight) memcpy(w.of, weight, sizeof w.of);
    return apply(tape, maps, target, &w);
}

static float weight_of(const ag_node *node, int64_t i)
{
    const weights *w = node->attr;
    return w->given ? w->of[i % MAP_CHANNELS] : 1;
}

/* The weights of PERIOD values from any on, the first of channel 0: of[first % MAP_CHANNELS + i] is that of value first
 * + i. Loops over them have neither divisions nor branches. */
enum { PERIOD = 56 * MAP_CHANNELS, LANES = 8 };
typedef struct weight_table {
    float of[PERIOD + MAP_CHANNELS];
} weight_table;

static weight_table table_of(const ag_node *node, float factor)
{
    weight_table t;
    for (int i = 0; i < PERIOD + MAP_CHANNELS; i++) t.of[i] = factor * weight_of(node, i);
    return t;
}

typedef struct loss_job {
    const ag_node *node;
    const weight_table *table;
    double *sums;
    float *to;
    bool add;
} loss_job;

static void sum_chunk(const void *job, int64_t k)
{
    const loss_job *j = job;
    const int64_t count = ts_count(j->node->in[0]->t.shape), first = k * AG_CHUNK,
                  last = first + ag_part(count, first, AG_CHUNK);
    const float *w = j->table->of + first % MAP_CHANNELS;
    double lane[LANES] = {0}, part = 0; /* of every eighth value: additions that need not wait for each other */
    for (int64_t at = first; at < last; at += PERIOD) {
        const float *a = j->node->in[0]->t.data + at, *b = j->node->in[1]->t.data + at;
        const int64_t n = ag_part(last, at, PERIOD), whole = n / LANES * LANES;
        for (int64_t i = 0; i < whole; i += LANES)
            for (int l = 0; l < LANES; l++) lane[l] += (double)w[i + l] * fabs((double)a[i + l] - (double)b[i + l]);
        for (int64_t i = whole; i < n; i++) lane[i - whole] += (double)w[i] * fabs((double)a[i] - (double)b[i]);
    }
    for (int l = 0; l < LANES; l++) part += lane[l];
    j->sums[k] = part;
}

static void forward(ag_tape *tape, ag_node *node)
{
    int64_t count = ts_count(node->in[0]->t.shape), chunks = (count + AG_CHUNK - 1) / AG_CHUNK;
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)chunks * sizeof *sums), sum = 0;
    if (!sums) {
        ag_fail(tape, TS_NOMEM, "map_loss: no memory for %lld sums", (long long)chunks);
        return;
    }
    const weight_table table = table_of(node, 1);
    ts_tasks(ag_threads(tape), chunks, sum_chunk, &(loss_job){.node = node, .table = &table, .sums = sums});
    for (int64_t k = 0; k < chunks; k++) sum += sums[k];
    node->out->t.data[0] = (float)(sum / (double)count);
}

/* w with the sign of a - b. A branch would be mispredicted at every other value. */
static inline float slope(float w, float a, float b) { return w * (float)((a > b) - (a < b)); }

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const loss_job *j = job;
    const float *w = j->table->of + begin % MAP_CHANNELS;
    for (int64_t at = begin; at < end; at += PERIOD) {
        const float *a = j->node->in[0]->t.data + at, *b = j->node->in[1]->t.data + at;
        float *restrict to = j->to + at;
        const int64_t n = ag_part(end, at, PERIOD);
        if (j->add)
            for (int64_t i = 0; i < n; i++) to[i] += slope(w[i], a[i], b[i]);
        else
            for (int64_t i = 0; i < n; i++) to[i] = slope(w[i], a[i], b[i]);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const int64_t count = ts_count(node->in[0]->t.shape);
    const weight_table table = table_of(node, (float)((double)node->out->grad[0] / (double)count));
    loss_job j = {.node = node, .table = &table};
    j.to = ag_grad_target(tape, node->in[0], &j.add);
    if (j.to) ts_for(ag_threads(tape), count, AG_CHUNK, backward_range, &j);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    int64_t count = ts_count(node->in[0]->t.shape);
    double sum = 0;
    for (int64_t i = 0; i < count; i++) sum += (double)weight_of(node, i) * fabs(in[0][i] - in[1][i]);
    out[0] = sum / (double)count;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    (void)input, (void)user;
    return fabs(in[0][i] - in[1][i]) <= step;
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    static const float weight[MAP_CHANNELS] = {1, 0.5f, 1, 3, 3, 1, 2, 0, 2};
    return ag_map_loss(tape, in[0], in[1], *(const bool *)user ? weight : NULL);
}

static void cases(ag_gradcheck *g)
{
    static const ts_shape shapes[] = {{1, 1, 1, 1}, {2, 3, 5, 9}, {1, 64, 33, 9}, {2, 3, 5, 9}};
    static const bool weighted[] = {false, false, false, true};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {.label = i ? "images" : "one value",
                     .inputs = 2,
                     .shape = {shapes[i], shapes[i]},
                     .fixed = {false, true},
                     .lo = -1.5f,
                     .hi = 1.5f,
                     .kink = kink,
                     .build = build,
                     .user = &weighted[i]};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_map_loss = {
    .name = "map_loss", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
