/* R_0 = g(photographs). */
#include "nn/lgd_internal.h"
#include "ops.h"
#include "render/tone.h"
#include "tensor/resize.h"
#include <string.h>

bool nn_input_check(ag_tape *tape, const nn_model *model, const nn_input *in)
{
    ts_shape s = in->image.shape;
    if (ag_status(tape)->code) return false;
    if (!model->value) ag_fail(tape, TS_INVALID, "the model has no parameters");
    else if (model->coder.code > 0)
        ag_fail(tape, TS_INVALID, "the model is an auto-encoder of maps: it cannot read a photograph");
    else if (!in->image.data || s.c != 3)
        ag_fail(tape, TS_INVALID, "the photograph has %d channels: 3 are needed", s.c);
    else if (nn_given(in) > nn_most_photographs(&model->arch))
        ag_fail(tape, TS_INVALID, "%d photographs are given: the model reads %d", nn_given(in),
                nn_most_photographs(&model->arch));
    else if (s.n % nn_given(in) != 0)
        ag_fail(tape, TS_INVALID, "%d photographs are not a multiple of %d", s.n, nn_given(in));
    else if (in->tellings > 1 && (ag_gradients(tape) || !in->parts))
        ag_fail(tape, TS_INVALID, "g is told %d scenes: that is for estimates, and needs their parts", in->tellings);
    else if (!ts_contiguous(&in->image)) ag_fail(tape, TS_INVALID, "the photograph is not contiguous");
    else if (s.h != in->grid.h || s.w != in->grid.w)
        ag_fail(tape, TS_INVALID, "the photograph is %d x %d pixels, its grid %d x %d", s.w, s.h, in->grid.w,
                in->grid.h);
    else if (in->whole.data && !ts_same(in->whole.shape, (ts_shape){s.n, in->grid.side, in->grid.side, 3}))
        ag_fail(tape, TS_INVALID, "the whole photograph is %d x %d pixels, the window's grid says %d",
                in->whole.shape.w, in->whole.shape.h, in->grid.side);
    return !ag_status(tape)->code;
}

/* [N * given, S, S, 3] to [N, S, S, 3 images]. */
static void side_by_side(const ts_tensor *from, int count, int images, float *to)
{
    const int64_t pixels = (int64_t)from->shape.h * from->shape.w, rows = from->shape.n / count * pixels;
    for (int64_t i = 0; i < rows; i++) {
        const int64_t n = i / pixels, at = i % pixels;
        for (int k = 0; k < images; k++)
            for (int c = 0; c < 3; c++)
                to[(i * images + k) * 3 + c] = k < count ? from->data[((n * count + k) * pixels + at) * 3 + c]
                                                         : -1.0f; /* -1: black, encoded */
    }
}

bool nn_resized(ag_tape *tape, const ts_tensor *photographs, int size, ts_tensor *to)
{
    ts_status st = {0};
    ag_value *v = ag_empty(tape, (ts_shape){photographs->shape.n, size, size, 3});
    if (v && ts_resize(&v->t, photographs, ag_arena(tape), ag_compute(tape)->threads, &st))
        ag_fail(tape, st.code, "%s", st.message);
    if (!v || ag_status(tape)->code) return false;
    *to = v->t;
    return true;
}

/* The whole photographs, linear, resampled to g_size: small. False after an error. */
static bool resample_for_g(ag_tape *tape, const nn_model *model, const nn_input *in, nn_input *small)
{
    if (!nn_input_check(tape, model, in)) return false;
    const ts_tensor *whole = in->whole.data ? &in->whole : &in->image;
    const int size = nn_arch_side(&model->arch);
    if (whole->shape.h != whole->shape.w)
        return ag_fail(tape, TS_INVALID, "the photograph is %d x %d pixels: g needs a square", whole->shape.w,
                       whole->shape.h),
               false;
    *small = (nn_input){.image = *whole,
                        .grid = rd_grid_full(size),
                        .view = in->view,
                        .views = in->views,
                        .known = in->known,
                        .given = in->given,
                        .tellings = in->tellings,
                        .parts = in->parts,
                        .orientations = in->orientations};
    return whole->shape.h == size || nn_resized(tape, whole, size, &small->image);
}

static bool central(const float p[3]) { return p[0] == 0 && p[1] == 0; }

bool nn_orients(const nn_model *model, const nn_input *in)
{
    const rd_view view = nn_view_of(model, in, 0);
    return in->image.shape.n == 1 && model->arch.compat == NN_COMPAT_NONE && central(view.camera) &&
        central(view.light);
}

/* g of photographs of its size. */
static bool run_g(ag_tape *tape, const nn_model *model, const nn_input *small, nn_guess *guess)
{
    const ts_shape s = small->image.shape;
    const int images = model->arch.images, count = nn_given(small);
    *guess = (nn_guess){0};
    if (count > images) return ag_fail(tape, TS_INVALID, "g reads %d photographs, not %d", images, count), false;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *x = ag_empty(tape, (ts_shape){s.n / count, s.h, s.w, 3 * images}),
             *each = images == 1 ? x : ag_empty(tape, s);
    if (!x || !each) return false;
    rd_log_encode(ts_count(s), small->image.data, each->t.data, ag_compute(tape)->threads);
    if (images > 1) side_by_side(&each->t, count, images, x->t.data);
    ag_value *conditions = model->arch.conditions ? nn_conditions(tape, model, small) : NULL;
    if (model->arch.conditions && !conditions) return false;
    if (small->orientations > 1 && !ag_gradients(tape) && nn_orients(model, small))
        nn_unet_oriented(tape, model, x, conditions, small, small->orientations, guess);
    else nn_unet(tape, model, x, conditions, small, guess);
    ag_value *keep[3] = {guess->maps, guess->spread, guess->scene};
    ag_scope_end(tape, mark, keep, 3);
    *guess = (nn_guess){keep[0], keep[1], keep[2]};
    return !ag_status(tape)->code;
}

bool nn_guess_from(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess)
{
    nn_input small;
    return resample_for_g(tape, model, in, &small) && run_g(tape, model, &small, guess);
}

bool nn_coarse_begin(ag_tape *tape, const nn_model *model, const nn_input *in, nn_coarse *c)
{
    *c = (nn_coarse){0};
    const ts_mark mark = ag_scope_begin(tape);
    if (in->r0) {
        const int size = nn_arch_side(&model->arch);
        if (!nn_input_check(tape, model, in)) return false;
        c->maps = ag_constant(
            tape, ts_view((float *)(uintptr_t)in->r0, (ts_shape){nn_materials(in), size, size, model->arch.channels}));
    } else {
        nn_guess guess;
        if (!nn_guess_from(tape, model, in, &guess)) return false;
        c->maps = guess.maps;
    }
    ag_scope_end(tape, mark, &c->maps, 1);
    if (!c->maps) return false;
    const ts_tensor whole = in->whole.data ? in->whole : in->image;
    c->side = whole.shape.h;
    c->in = (nn_input){.image = whole,
                       .grid = rd_grid_full(whole.shape.h),
                       .view = in->view,
                       .views = in->views,
                       .known = in->known,
                       .given = in->given,
                       .recompute = in->recompute};
    return true;
}

ag_value *nn_predict(ag_tape *tape, const nn_model *model, const nn_input *in)
{
    nn_coarse c;
    const ts_mark mark = ag_scope_begin(tape);
    if (!nn_coarse_begin(tape, model, in, &c)) return NULL;
    ag_value *maps = c.maps;
    const int side = c.side;
    if (side != nn_arch_side(&model->arch)) maps = ag_resize_smooth(tape, maps, side, side);
    ag_scope_end(tape, mark, &maps, 1);
    return maps;
}
