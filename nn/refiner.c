/* h: two convolutional gated recurrent units (docs/math.md, M10), and the step that adds its change (S4). */
#include "nn/layers.h"
#include "ops.h"

static ag_value *cell(ag_tape *tape, const nn_model *model, const nn_cell *c, ag_value *x, ag_value *constants,
                      int dilation, ag_value *old, ag_value *to)
{
    x = nn_conv_with_constants(tape, model, c->conv, x, constants, dilation, TS_PAD_REPLICATE, NN_LEAK_H);
    if (to) ag_into(tape, to);
    return ag_gru(tape, x, old, nn_parameter(tape, model, c->input.weight), nn_parameter(tape, model, c->input.bias),
                  nn_parameter(tape, model, c->hidden.weight), nn_parameter(tape, model, c->hidden.bias));
}

ag_value *nn_change(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *gradient,
                    ag_value *gru[2], ag_value *const to[2])
{
    ag_value *x = maps;
    for (int i = 0; i < 2; i++) {
        ts_mark mark = ag_scope_begin(tape);
        gru[i] = cell(tape, model, &h->cell[i], x, i == 0 ? gradient : NULL, i + 1,
                      model->arch.recurrent ? gru[i] : NULL, to ? to[i] : NULL);
        ag_scope_end(tape, mark, &gru[i], 1);
        x = gru[i];
    }
    return ag_tanh(tape, nn_conv(tape, model, h->output, x, 1, TS_PAD_REPLICATE, 1));
}

/* d itself on a tape without gradients. */
static ag_value *scaled(ag_tape *tape, ag_value *d, float length)
{
    if (length == 1) return d;
    if (d && !ag_gradients(tape)) ag_into(tape, d);
    return ag_scale(tape, d, length);
}

ag_value *nn_step(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *descent,
                  ag_value *gradient, ag_value *gru[2], ag_value *const to[2], float length, ag_value *into)
{
    ag_value *next = maps;
    if (h->width > 0) {
        ag_value *change = scaled(tape, nn_change(tape, model, h, maps, gradient, gru, to), length);
        if (!descent) ag_into(tape, into);
        next = ag_add(tape, maps, change);
    }
    if (!descent) return next;
    ag_value *moved = scaled(tape, nn_conv(tape, model, h->descent, descent, 1, TS_PAD_ZERO, 1), length);
    ag_into(tape, into);
    return ag_add(tape, next, moved);
}

int nn_refiner_reach(const nn_model *model)
{
    const nn_refiner *h = &((const nn_layers *)model->layers)->h;
    if (h->width == 0) return 0;
    int reach = model->param[h->output.weight].dim[2] / 2;
    for (int i = 0; i < 2; i++)
        reach += (i + 1) * (model->param[h->cell[i].conv.weight].dim[2] / 2); /* the second is dilated by 2 */
    return reach;
}
