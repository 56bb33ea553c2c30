/* What g adds at the photograph's size: convolutions of squares of pixels that no normalisation follows, so that they
 * keep how strong relief and gloss are, then some at half of its side where arch.g_half asks for them, and two at the
 * full size. */
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

static void put_rows(const void *job, int64_t begin, int64_t end)
{
    const places *p = job;
    const int side = p->side;
    const size_t row = (size_t)side * NN_COORDINATES;
    for (int64_t y = begin; y < end; y++) {
        float *to = p->to + (size_t)y * row;
        const float down = nn_place((int)(y % side), side);
        for (int x = 0; x < side; x++) {
            to[NN_COORDINATES * x] = y == begin ? nn_place(x, side) : to[NN_COORDINATES * x - (ptrdiff_t)row];
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

/* Where a result goes that outlives the scope in which it is made: NULL on a tape with gradients, which has no scopes.
 */
static ag_value *room(ag_tape *tape, ts_shape s) { return ag_gradients(tape) ? NULL : ag_empty(tape, s); }

/* What is made next of v takes v's place where nobody asks for v again. */
static ag_value *in_place(ag_tape *tape, ag_value *v)
{
    if (v && !ag_gradients(tape)) ag_into(tape, v);
    return v;
}

ag_value *nn_squares_room(ag_tape *tape, const nn_model *model, int images)
{
    const nn_arch *a = &model->arch;
    return a->g_unshuffle > 1 ? room(tape, (ts_shape){images, a->g_size, a->g_size, a->g_detail}) : NULL;
}

ag_value *nn_squares(ag_tape *tape, const nn_model *model, ag_value *seen, ag_value *features, ag_value *to)
{
    const nn_layers *l = model->layers;
    ts_mark mark = ag_scope_begin(tape);
    ag_value *y = nn_conv(tape, model, l->detail[0], seen, 1, TS_PAD_ZERO, NN_LEAK_G);
    y = ag_concat(tape, y, features);
    ag_into(tape, to);
    y = nn_conv(tape, model, l->detail[1], y, 1, TS_PAD_ZERO, NN_LEAK_G);
    ag_scope_end(tape, mark, NULL, 0);
    for (int i = 0; i < model->arch.g_trunk; i++) {
        mark = ag_scope_begin(tape);
        ag_value *change = nn_conv(tape, model, l->trunk[i][0], y, 2, TS_PAD_ZERO, NN_LEAK_G);
        change = nn_conv(tape, model, l->trunk[i][1], change, 1, TS_PAD_ZERO, 1);
        y = ag_add(tape, in_place(tape, y), change);
        ag_scope_end(tape, mark, NULL, 0);
    }
    return y;
}

/* What y and squares of 2 x 2 pixels of the photograph give each pixel of the full size, made at half of its side. */
static ag_value *from_half(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y)
{
    const nn_layers *l = model->layers;
    y = nn_conv(tape, model, l->half[0], y, 1, TS_PAD_ZERO, NN_LEAK_G);
    if (model->arch.g_unshuffle > 2) y = ag_depth_to_space(tape, y, model->arch.g_unshuffle / 2);
    y = nn_conv_with_constants(tape, model, l->half[1], y, ag_space_to_depth(tape, photo, 2), 1, TS_PAD_REPLICATE,
                               NN_LEAK_G);
    ag_value *change = nn_conv(tape, model, l->half[2], y, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    change = nn_conv(tape, model, l->half[3], change, 1, TS_PAD_REPLICATE, 1);
    y = ag_add(tape, in_place(tape, y), change);
    return ag_depth_to_space(tape, nn_conv(tape, model, l->half[4], y, 1, TS_PAD_ZERO, 1), 2);
}

/* The channels of the full size's pixels, square by square, then as pixels: [N, S, S, nn_detail_writes]. */
static ag_value *pixels(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *coordinates, ag_value *y)
{
    const nn_layers *l = model->layers;
    ag_value *half = model->arch.g_half > 0 ? from_half(tape, model, photo, y) : NULL;
    y = nn_conv(tape, model, l->detail[2], y, 1, TS_PAD_ZERO, NN_LEAK_G);
    y = ag_depth_to_space(tape, y, model->arch.g_unshuffle);
    if (half) y = ag_add(tape, in_place(tape, y), half);
    y = nn_conv_with_constants(tape, model, l->detail[3], y, ag_concat(tape, photo, coordinates), 1, TS_PAD_REPLICATE,
                               NN_LEAK_G);
    return nn_conv(tape, model, l->detail[4], y, 1, TS_PAD_REPLICATE, 1);
}

/* Rows begin to end - 1 of an image. */
static ag_value *rows(ag_tape *tape, const ag_value *v, int begin, int end)
{
    if (!v) return NULL;
    ts_shape part = v->t.shape;
    part.h = end - begin;
    return ag_constant(tape, ts_view(v->t.data + (ptrdiff_t)begin * part.w * part.c, part));
}

/* The same of one image, some rows of squares at a time: memory that is used again is in the caches and need not be
 * cleared by the system. Rows of squares more on either side are as many as the convolutions reach, so that no value
 * depends on the bands but by rounding, which Winograd's tiles share; where the image goes on, what their own edge
 * gives is left out. */
static ag_value *pixels_in_bands(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y)
{
    if (!photo || !y) return NULL;
    const ts_shape s = photo->t.shape;
    const int r = model->arch.g_unshuffle, squares = y->t.shape.h, more = nn_band_margin(&model->arch);
    ag_value *to = ag_empty(tape, (ts_shape){1, s.h, s.w, nn_detail_writes(&model->arch)}),
             *coordinates = nn_coordinates(tape, 1, s.h);
    for (int begin = 0; begin < squares && !ag_status(tape)->code; begin += NN_BAND) {
        const int end = begin + NN_BAND < squares ? begin + NN_BAND : squares, above = begin < more ? begin : more,
                  below = squares - end < more ? squares - end : more, top = (begin - above) * r,
                  bottom = (end + below) * r;
        const ts_mark mark = ag_scope_begin(tape);
        const ag_value *band = pixels(tape, model, rows(tape, photo, top, bottom), rows(tape, coordinates, top, bottom),
                                      rows(tape, y, begin - above, end + below));
        const ptrdiff_t row = (ptrdiff_t)s.w * nn_detail_writes(&model->arch);
        if (band)
            ts_memory_copy(to->t.data + begin * r * row, band->t.data + above * r * row,
                           (size_t)((end - begin) * r * row) * sizeof(float), ag_compute(tape)->threads);
        ag_scope_end(tape, mark, NULL, 0);
    }
    return to;
}

/* guess: NULL, or where maps and spread go. */
static bool full_size(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *coarse,
                      nn_guess *guess)
{
    const int framed = model->arch.channels + NN_FRAME;
    if (!photo || !y || !coarse) return false;
    y = ag_gradients(tape) ? pixels(tape, model, photo, nn_coordinates(tape, photo->t.shape.n, photo->t.shape.h), y)
                           : pixels_in_bands(tape, model, photo, y);
    ag_value *added = ag_shading_frame(tape, ag_channels(tape, y, 0, framed));
    ag_into(tape, guess->maps);
    ag_value *sum = ag_resize_smooth(tape, coarse, photo->t.shape.h, photo->t.shape.w);
    sum = in_place(tape, ag_add(tape, in_place(tape, sum), added));
    guess->maps = ag_tanh(tape, sum);
    ag_into(tape, guess->spread);
    if (model->arch.spread) guess->spread = ag_channels(tape, y, framed, NN_SPREADS);
    return guess->maps && (guess->spread || !model->arch.spread);
}

/* Image k of v. */
static ag_value *image(ag_tape *tape, const ag_value *v, int k)
{
    if (!v) return NULL;
    ts_shape one = v->t.shape;
    one.n = 1;
    return ag_constant(tape, ts_view(v->t.data + (int64_t)k * ts_count(one), one));
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
        nn_guess one = {.maps = image(tape, guess->maps, k)};
        if (model->arch.spread) one.spread = image(tape, guess->spread, k);
        full_size(tape, model, image(tape, photo, k), image(tape, y, k), image(tape, coarse, k), &one);
        ag_scope_end(tape, mark, NULL, 0);
    }
    return !ag_status(tape)->code;
}

bool nn_full_size(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *coarse, nn_guess *guess)
{
    if (!photo || !y || !coarse) return false;
    return ag_gradients(tape) ? full_size(tape, model, photo, y, coarse, guess)
                              : full_size_of_each(tape, model, photo, y, coarse, guess);
}
