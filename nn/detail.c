/* What g adds at the photograph's size: convolutions of squares of pixels that no normalisation follows, so that they
 * keep how strong relief and gloss are, and two at the full size. */
#include "nn/layers.h"
#include "ops.h"
#include "render/losses.h"
#include "tensor/memory.h"
#include "tensor/team.h"
#include <stddef.h>

typedef struct places {
    int side;
    float *to;
} places;

static float place(int i, int side) { return (2 * (float)i + 1) / (float)side - 1; }

static void put_rows(const void *job, int64_t begin, int64_t end)
{
    const places *p = job;
    const int side = p->side;
    const size_t row = (size_t)side * NN_COORDINATES;
    for (int64_t y = begin; y < end; y++) {
        float *to = p->to + (size_t)y * row;
        const float down = place((int)(y % side), side);
        for (int x = 0; x < side; x++) {
            to[NN_COORDINATES * x] = y == begin ? place(x, side) : to[NN_COORDINATES * x - (ptrdiff_t)row];
            to[NN_COORDINATES * x + 1] = down;
        }
    }
}

ag_value *nn_coordinates(ag_tape *tape, int n, int side)
{
    ag_value *v = ag_empty(tape, (ts_shape){n, side, side, NN_COORDINATES});
    if (v) ts_for(ag_compute(tape)->threads, (int64_t)n * side, 16, put_rows, &(places){side, v->t.data});
    return v;
}

/* [N, g_size, g_size, ...]: the channels of the full size's pixels, square by square. */
static ag_value *squares(ag_tape *tape, const nn_model *model, ag_value *seen, ag_value *features)
{
    const nn_layers *l = model->layers;
    ag_value *y = nn_conv(tape, model, l->detail[0], seen, 1, TS_PAD_ZERO, NN_LEAK_G);
    y = nn_conv(tape, model, l->detail[1], ag_concat(tape, y, features), 1, TS_PAD_ZERO, NN_LEAK_G);
    for (int i = 0; i < model->arch.g_trunk; i++) {
        ag_value *change = nn_conv(tape, model, l->trunk[i][0], y, 2, TS_PAD_ZERO, NN_LEAK_G);
        y = ag_add(tape, y, nn_conv(tape, model, l->trunk[i][1], change, 1, TS_PAD_ZERO, 1));
    }
    return nn_conv(tape, model, l->detail[2], y, 1, TS_PAD_ZERO, NN_LEAK_G);
}

/* What is made next of v takes v's place where nobody asks for v again. */
static ag_value *in_place(ag_tape *tape, ag_value *v)
{
    if (v && !ag_gradients(tape)) ag_into(tape, v);
    return v;
}

static bool full_size(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *coarse,
                      nn_guess *guess)
{
    const nn_layers *l = model->layers;
    const int framed = model->arch.channels + NN_FRAME;
    y = ag_depth_to_space(tape, y, model->arch.g_unshuffle);
    if (!y || !coarse) return false;
    const int n = y->t.shape.n, side = y->t.shape.h;
    y = nn_conv_with_constants(tape, model, l->detail[3], y, ag_concat(tape, photo, nn_coordinates(tape, n, side)), 1,
                               TS_PAD_REPLICATE, NN_LEAK_G);
    y = nn_conv(tape, model, l->detail[4], y, 1, TS_PAD_REPLICATE, 1);
    ag_value *added = ag_shading_frame(tape, ag_channels(tape, y, 0, framed));
    ag_value *sum = in_place(tape, ag_resize_smooth(tape, coarse, side, side));
    sum = in_place(tape, ag_add(tape, sum, added));
    guess->maps = ag_tanh(tape, sum);
    if (model->arch.spread) guess->spread = ag_channels(tape, y, framed, NN_SPREADS);
    return guess->maps && (guess->spread || !model->arch.spread);
}

/* Image k of v. */
static ag_value *image(ag_tape *tape, const ag_value *v, int k)
{
    ts_shape one = v->t.shape;
    one.n = 1;
    return ag_constant(tape, ts_view(v->t.data + (int64_t)k * ts_count(one), one));
}

static void put_image(const ag_tape *tape, const ag_value *one, int k, ag_value *all)
{
    const int64_t count = ts_count(one->t.shape);
    ts_memory_copy(all->t.data + k * count, one->t.data, (size_t)count * sizeof(float), ag_compute(tape)->threads);
}

/* One image after the other: at the full size there is much of each. */
static bool full_size_of_each(ag_tape *tape, const nn_model *model, const ag_value *photo, const ag_value *y,
                              const ag_value *coarse, nn_guess *guess)
{
    const int n = photo->t.shape.n, side = photo->t.shape.h;
    guess->maps = ag_empty(tape, (ts_shape){n, side, side, model->arch.channels});
    if (model->arch.spread) guess->spread = ag_empty(tape, (ts_shape){n, side, side, NN_SPREADS});
    for (int k = 0; k < n && !ag_status(tape)->code; k++) {
        const ts_mark mark = ag_scope_begin(tape);
        nn_guess one = {0};
        if (full_size(tape, model, image(tape, photo, k), image(tape, y, k), image(tape, coarse, k), &one)) {
            put_image(tape, one.maps, k, guess->maps);
            if (one.spread) put_image(tape, one.spread, k, guess->spread);
        }
        ag_scope_end(tape, mark, NULL, 0);
    }
    return !ag_status(tape)->code;
}

bool nn_detail(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *seen, ag_value *features,
               ag_value *coarse, nn_guess *guess)
{
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *y = squares(tape, model, seen, features);
    ag_scope_end(tape, mark, &y, 1);
    if (!y || !coarse) return false;
    return ag_gradients(tape) ? full_size(tape, model, photo, y, coarse, guess)
                              : full_size_of_each(tape, model, photo, y, coarse, guess);
}
