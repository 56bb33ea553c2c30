/* g: a U-Net with a global track (Deschaintre et al. 2018, as changed by Luo et al. 2024). */
#include "nn/lgd_internal.h"
#include "ops.h"
#include "tensor/team.h"
#include <string.h>

#define NORM_EPSILON 1e-5f /* as published; a constant channel becomes zero instead of 0/0 */

/* x [N, H, W, in] -> [N, H, W, out], global [N, 1, 1, in'] -> [N, 1, 1, out]. */
static void block(ag_tape *tape, const nn_model *model, const nn_unet_block *b, bool norm, ag_value **x,
                  ag_value **global)
{
    ag_value *y = nn_conv(tape, model, b->conv1, *x, 1, TS_PAD_ZERO, 1);
    y = nn_conv(tape, model, b->conv2, y, 1, TS_PAD_ZERO, 1);
    ag_value *mean = model->arch.mean_before_norm ? ag_channel_mean(tape, y) : NULL;
    if (norm) y = ag_instance_norm(tape, y, NORM_EPSILON);
    if (!mean) mean = ag_channel_mean(tape, y);
    *x = ag_add_leaky(tape, y, nn_linear(tape, model, b->add, *global), NN_LEAK_G);
    *global = ag_selu(tape, nn_linear(tape, model, b->global, ag_concat(tape, mean, *global)));
}

/* n images: each of x's as often as the others, one after the other, or all of them over and over. */
static ag_value *repeated(ag_tape *tape, ag_value *x, int n, bool over_and_over)
{
    if (!x || x->t.shape.n == n) return x;
    ts_shape s = x->t.shape;
    const int have = s.n;
    const size_t one = (size_t)(ts_count(s) / have);
    s.n = n;
    ag_value *all = ag_empty(tape, s);
    for (int i = 0; all && i < n; i++)
        memcpy(all->t.data + (size_t)i * one, x->t.data + (size_t)(over_and_over ? i % have : i / (n / have)) * one,
               one * sizeof(float));
    return all;
}

typedef struct mean_job {
    const float *from;
    int64_t apart; /* from telling to telling */
    const nn_input *in;
    float *to;
} mean_job;

static void mean_range(const void *job, int64_t begin, int64_t end)
{
    const mean_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        float sum = 0;
        for (int t = 0; t < j->in->tellings; t++) sum += j->in->parts[t] * j->from[t * j->apart + i];
        j->to[i] = sum;
    }
}

/* [N, ...] of x [tellings N, ...]. */
static ag_value *mean_of(ag_tape *tape, ag_value *x, const nn_input *in)
{
    enum { WORTH = 1 << 15 }; /* values that another thread is worth */
    if (!x || in->tellings < 2) return x;
    ts_shape s = x->t.shape;
    s.n /= in->tellings;
    ag_value *mean = ag_empty(tape, s);
    if (mean)
        ts_for(ag_compute(tape)->threads, ts_count(s), WORTH, mean_range,
               &(mean_job){x->t.data, ts_count(s), in, mean->t.data});
    return mean;
}

/* What the first layers read: the photograph's pixels at g_size, where they are squares their place, and what is known.
 */
static ag_value *seen_by(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *conditions, int tellings)
{
    const int r = model->arch.g_unshuffle, n = photo ? photo->t.shape.n : 0;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *x = photo;
    if (r > 1) {
        x = ag_space_to_depth(tape, x, r);
        x = x ? ag_concat(tape, x, nn_coordinates(tape, n, x->t.shape.h)) : NULL;
    }
    x = repeated(tape, x, tellings * n, true);
    if (conditions) x = ag_concat(tape, x, repeated(tape, conditions, tellings * n, false));
    ag_scope_end(tape, mark, &x, 1);
    return x;
}

/* How g is computed before its last block. The first normalisation of the published g magnifies rounding up to six
 * times, the others carry it on (docs/published.md): no Winograd there, but where more is rounded anyway, in bf16, and
 * for training, whose gradients are noisier. */
static ts_compute careful(const ag_tape *tape, const nn_model *model)
{
    ts_compute c = *ag_compute(tape);
    c.exact |= model->arch.compat == NN_COMPAT_PUBLISHED && c.precision == TS_F32 && !ag_gradients(tape);
    return c;
}

static bool run(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *conditions, const nn_input *in,
                nn_guess *guess)
{
    const nn_layers *l = model->layers;
    const int levels = model->arch.g_levels;
    *guess = (nn_guess){0};
    if (!photo) return false;
    const ts_compute asked = *ag_compute(tape);
    ag_compute_set(tape, careful(tape, model));
    ag_value *squares = nn_squares_room(tape, model, photo->t.shape.n);
    const ts_mark begun = ag_scope_begin(tape);
    ag_value *seen = seen_by(tape, model, photo, conditions, nn_times_told(in));
    ag_value *skip[NN_MAX_LEVELS],
        *global = ag_selu(tape, nn_linear(tape, model, l->input_global, ag_channel_mean(tape, seen)));
    ag_value *x = nn_conv(tape, model, l->input_conv, seen, 1, TS_PAD_ZERO, NN_LEAK_G);
    for (int i = 0; i < levels; i++) {
        skip[i] = x;
        ts_mark mark = ag_scope_begin(tape);
        ag_value *keep[2] = {ag_max_pool(tape, x), global};
        block(tape, model, &l->down[i], i < levels - 1, &keep[0], &keep[1]);
        ag_scope_end(tape, mark, keep, 2);
        x = keep[0];
        global = keep[1];
    }
    if (model->arch.scene)
        guess->scene = nn_linear(tape, model, l->scene[1], ag_selu(tape, nn_linear(tape, model, l->scene[0], global)));
    for (int i = 0; i < levels; i++) {
        if (i == levels - 1) ag_compute_set(tape, asked);
        ts_mark mark = ag_scope_begin(tape);
        ag_value *keep[2] = {ag_concat(tape, skip[levels - 1 - i], ag_upsample(tape, x)), global};
        block(tape, model, &l->up[i], true, &keep[0], &keep[1]);
        ag_scope_end(tape, mark, keep, 2);
        x = keep[0];
        global = keep[1];
    }
    ag_value *features = x;
    x = nn_conv(tape, model, l->output_conv1, x, 1, TS_PAD_ZERO, 1);
    x = nn_conv(tape, model, l->output_conv2, x, 1, TS_PAD_ZERO, 1);
    x = ag_add_leaky(tape, x, nn_linear(tape, model, l->output_add, global), 1);
    x = mean_of(tape, x, in);
    const bool detailed = model->arch.g_unshuffle > 1;
    if (detailed) squares = nn_squares(tape, model, mean_of(tape, seen, in), mean_of(tape, features, in), squares);
    else x = ag_tanh(tape, x);
    ag_value *keep[3] = {x, squares, guess->scene};
    ag_scope_end(tape, begun, keep, 3);
    *guess = (nn_guess){.maps = detailed ? NULL : keep[0], .scene = keep[2]};
    return detailed ? nn_full_size(tape, model, photo, keep[1], keep[0], guess) : guess->maps != NULL;
}

bool nn_unet(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *conditions, const nn_input *in,
             nn_guess *guess)
{
    ag_pass(tape, model->g_once);
    const bool done = run(tape, model, photo, conditions, in, guess);
    ag_pass(tape, false);
    return done;
}
