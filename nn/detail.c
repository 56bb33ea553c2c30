/* What g adds at the photograph's size: convolutions of squares of pixels that no normalisation follows, so that they
 * keep how strong relief and gloss are, then some at half of its side where arch.g_half asks for them, and two at the
 * full size. */
#include "nn/layers.h"
#include "ops.h"
#include "render/losses.h"
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
        y = nn_conv_add(tape, model, l->trunk[i][1], in_place(tape, y), change, 1, TS_PAD_ZERO);
        ag_scope_end(tape, mark, NULL, 0);
    }
    return y;
}

/* What y and squares of 2 x 2 pixels of the photograph give each pixel of the full size, made at half of its side. */
static ag_value *from_half(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *to)
{
    const nn_layers *l = model->layers;
    const ts_shape s = photo->t.shape;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *seen = room(tape, (ts_shape){s.n, s.h / 2, s.w / 2, model->arch.g_half});
    const ts_mark inner = ag_scope_begin(tape);
    y = nn_conv(tape, model, l->half[0], y, 1, TS_PAD_ZERO, NN_LEAK_G);
    if (model->arch.g_unshuffle > 2) y = ag_depth_to_space(tape, y, model->arch.g_unshuffle / 2);
    ag_value *four = ag_space_to_depth(tape, photo, 2);
    ag_into(tape, seen);
    y = nn_conv_with_constants(tape, model, l->half[1], y, four, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    ag_scope_end(tape, inner, NULL, 0);
    ag_value *change = nn_conv(tape, model, l->half[2], y, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    y = nn_conv_add(tape, model, l->half[3], in_place(tape, y), change, 1, TS_PAD_REPLICATE);
    y = nn_conv(tape, model, l->half[4], y, 1, TS_PAD_ZERO, 1);
    ag_into(tape, to);
    y = ag_depth_to_space(tape, y, 2);
    ag_scope_end(tape, mark, NULL, 0);
    return y;
}

/* The channels of the full size's pixels, square by square, then as pixels: [N, H, S, nn_detail_writes]. */
static ag_value *pixels(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *coordinates, ag_value *y)
{
    if (!photo || !y) return NULL;
    const nn_layers *l = model->layers;
    const ts_shape s = photo->t.shape, fine = {s.n, s.h, s.w, NN_FINE};
    ag_value *to = room(tape, fine), *half = NULL;
    const ts_mark mark = ag_scope_begin(tape);
    if (model->arch.g_half > 0) half = from_half(tape, model, photo, y, to);
    y = nn_conv(tape, model, l->detail[2], y, 1, TS_PAD_ZERO, NN_LEAK_G);
    ag_into(tape, to); /* where half is, which is added pixel by pixel */
    y = half ? ag_depth_to_space_add(tape, y, model->arch.g_unshuffle, half)
             : ag_depth_to_space(tape, y, model->arch.g_unshuffle);
    ag_scope_end(tape, mark, NULL, 0);
    y = nn_conv_with_constants(tape, model, l->detail[3], y, ag_concat(tape, photo, coordinates), 1, TS_PAD_REPLICATE,
                               NN_LEAK_G);
    return nn_conv(tape, model, l->detail[4], y, 1, TS_PAD_REPLICATE, 1);
}

/* Of pixels' y, rows top .. of the image: what is added to the coarse maps, and the spread. to: where they go, or
 * empty. */
static void take_apart(ag_tape *tape, const nn_model *model, ag_value *y, int top, nn_guess *to)
{
    const int channels = model->arch.channels;
    ag_into(tape, to->maps);
    to->maps = ag_shading_frame(tape, y, channels, top);
    if (!model->arch.spread) return;
    ag_into(tape, to->spread);
    to->spread = ag_channels(tape, y, channels + NN_FRAME, NN_SPREADS);
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
static void in_bands(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, const nn_guess *to)
{
    const int r = model->arch.g_unshuffle, squares = y->t.shape.h, more = nn_band_margin(&model->arch);
    ag_value *coordinates = nn_coordinates(tape, 1, photo->t.shape.h);
    for (int begin = 0; begin < squares && !ag_status(tape)->code; begin += NN_BAND) {
        const int end = begin + NN_BAND < squares ? begin + NN_BAND : squares, above = begin < more ? begin : more,
                  below = squares - end < more ? squares - end : more, top = (begin - above) * r,
                  bottom = (end + below) * r;
        const ts_mark mark = ag_scope_begin(tape);
        const ag_value *band = pixels(tape, model, rows(tape, photo, top, bottom), rows(tape, coordinates, top, bottom),
                                      rows(tape, y, begin - above, end + below));
        nn_guess part = {.maps = rows(tape, to->maps, begin * r, end * r),
                         .spread = rows(tape, to->spread, begin * r, end * r)};
        take_apart(tape, model, rows(tape, band, above * r, (above + end - begin) * r), begin * r, &part);
        ag_scope_end(tape, mark, NULL, 0);
    }
}

/* guess: empty, or on a tape without gradients where maps and spread go. */
static bool full_size(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *coarse,
                      nn_guess *guess)
{
    if (!photo || !y || !coarse) return false;
    const ts_shape s = photo->t.shape;
    if (ag_gradients(tape))
        take_apart(tape, model, pixels(tape, model, photo, nn_coordinates(tape, s.n, s.h), y), 0, guess);
    else in_bands(tape, model, photo, y, guess);
    guess->maps = ag_resize_smooth_add(tape, in_place(tape, guess->maps), coarse);
    guess->maps = ag_tanh(tape, in_place(tape, guess->maps));
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
