/* The gradient of the whole unrolled loop against central differences in double: the recorded operations are run again
 * with their double references, so that the differences have no rounding to speak of. */
#include "autograd/op.h"
#include "nn/model.h"
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <stdlib.h>

enum { SIDE = 8, C = MAP_CHANNELS, MOST = 12, VALUES = 20000 };

typedef struct replay {
    const ag_tape *tape;
    const nn_model *model;
    const double *direction; /* of the parameter block */
    double step;
    int count;
    const ag_value *value[VALUES];
    double *number[VALUES];
} replay;

static double *numbers(replay *r, const ag_value *v)
{
    for (int i = r->count - 1; i >= 0; i--)
        if (r->value[i] == v) return r->number[i];
    const size_t count = (size_t)ts_count(v->t.shape);
    double *out = malloc(count * sizeof *out);
    const ag_node *node = ag_node_of(r->tape, v);
    if (!out || r->count == VALUES) abort();
    if (node) {
        const double *in[AG_MAX_INPUTS] = {NULL};
        for (int i = 0; i < node->inputs; i++) in[i] = node->in[i] ? numbers(r, node->in[i]) : NULL;
        node->op->reference(node, in, out);
    } else {
        const float *data = v->t.data, *block = r->model->value;
        const bool parameter = data >= block && data < block + r->model->count;
        for (size_t i = 0; i < count; i++)
            out[i] = (double)data[i] + (parameter ? r->step * r->direction[(size_t)(data - block) + i] : 0);
    }
    r->value[r->count] = v;
    r->number[r->count++] = out;
    return out;
}

static double loss_at(replay *r, const ag_value *loss, double step)
{
    r->step = step;
    r->count = 0;
    const double l = numbers(r, loss)[0];
    for (int i = 0; i < r->count; i++) free(r->number[i]);
    return l;
}

static nn_model *tiny(ts_status *st)
{
    nn_arch a = nn_arch_default();
    a.g_width = 4, a.g_width_max = 8, a.g_levels = 2, a.g_size = SIDE, a.h_width = 6, a.h_gru = 4;
    nn_model *m = nn_model_create(&a, st);
    if (!m || nn_model_train(m, st)) return m;
    nn_model_init(m, 21);
    const nn_param *p = nn_model_find(m, "h.output.weight"); /* h begins as the identity: its changes must count */
    for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] *= 100;
    return m;
}

bool stress_unrolled(const stress *s)
{
    static float truth[SIDE * SIDE * C], image[SIDE * SIDE * 3];
    const int directions = s->full ? 8 : 2;
    ts_status st = {0};
    nn_model *m = tiny(&st);
    ag_tape *tape = m ? ag_tape_create(true, &st) : NULL;
    replay *r = calloc(1, sizeof *r);
    double *direction = m ? malloc(m->count * sizeof *direction) : NULL, first = 0, last = 0;
    bool ok = tape && r && direction;
    if (!ok) printf("%s\n", st.message);
    ts_rng rng = ts_rng_make(8, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * C; i++) truth[i] = ts_rng_range(&rng, -0.6f, 0.6f);
    const rd_view flash = rd_flash();
    rd_render(rd_grid_full(SIDE), truth, C, &flash, true, image);
    rd_view views[RD_LOSS_VIEWS];
    rd_loss_views(&rng, views);
    for (int steps = 1; ok && steps <= MOST; steps += s->full || steps < 3 ? 1 : 3) {
        const nn_input in = {
            .image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = flash};
        ag_value *maps[MOST + 1];
        ag_reset(tape);
        for (size_t i = 0; i < m->count; i++) m->grad[i] = 0;
        nn_lgd(tape, m, &in, steps, true, maps, NULL);
        ag_value *goal = ag_constant(tape, ts_view(truth, (ts_shape){1, SIDE, SIDE, C}));
        ag_value *loss = ag_add(tape, ag_render_loss(tape, maps[steps], goal, views, RD_LOSS_VIEWS),
                                ag_map_loss(tape, maps[steps], goal, NULL));
        if (ag_backward(tape, loss)) {
            printf("%s\n", ag_status(tape)->message);
            ok = false;
            break;
        }
        double norm = 0, worst = 0;
        for (size_t i = 0; i < m->count; i++) norm += (double)m->grad[i] * (double)m->grad[i];
        norm = sqrt(norm);
        if (steps == 1) first = norm;
        last = norm;
        *r = (replay){.tape = tape, .model = m, .direction = direction};
        for (int d = 0; d < directions; d++) {
            double slope = 0, length = 0;
            for (size_t i = 0; i < m->count; i++)
                direction[i] = (double)ts_rng_normal(&rng), length += direction[i] * direction[i];
            for (size_t i = 0; i < m->count; i++)
                direction[i] /= sqrt(length), slope += direction[i] * (double)m->grad[i];
            const double h = 1e-6, difference = (loss_at(r, loss, h) - loss_at(r, loss, -h)) / (2 * h);
            /* what a random direction sees of a gradient of this length */
            worst = farther(worst, fabs(slope - difference) / (norm / sqrt((double)m->count)));
        }
        char what[96];
        snprintf(what, sizeof what, "unrolled loop, T = %d: |gradient| %.4g, worst of %d slopes", steps, norm,
                 directions);
        ok = stress_row(what, worst, 1e-3) && ok;
    }
    if (ok) ok = stress_row("unrolled loop: growth of the gradient from T = 1 to the last", last / first, INFINITY);
    free(direction);
    free(r);
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    return ok;
}
