/* The auto-encoder of maps, of the compared method `latent`: convolutional, without skips. */
#include "nn/layers.h"
#include "ops.h"

static ag_value *layer(ag_tape *tape, const nn_model *model, nn_layer l, ag_value *x)
{
    return nn_conv(tape, model, l, x, 1, TS_PAD_REPLICATE, NN_LEAK_G);
}

static bool is_one(ag_tape *tape, const nn_model *model)
{
    if (model->arch.latent > 0) return true;
    ag_fail(tape, TS_INVALID, "the model is no auto-encoder: it was not trained with model.latent");
    return false;
}

ag_value *nn_encode(ag_tape *tape, const nn_model *model, ag_value *maps)
{
    const nn_layers *l = model->layers;
    const int levels = model->arch.g_levels, unit = 1 << levels;
    if (!is_one(tape, model) || !maps) return NULL;
    const ts_shape s = maps->t.shape;
    if (s.h % unit || s.w % unit || s.c != model->arch.channels)
        return ag_fail(tape, TS_INVALID,
                       "the auto-encoder takes %d channels and sides that are multiples of %d, not %d x %d x %d",
                       model->arch.channels, unit, s.h, s.w, s.c);
    ts_mark mark = ag_scope_begin(tape);
    ag_value *x = layer(tape, model, l->encoder[0], maps);
    for (int i = 1; i <= levels; i++) x = layer(tape, model, l->encoder[i], ag_max_pool(tape, x));
    x = nn_conv(tape, model, l->code, x, 1, TS_PAD_REPLICATE, 1);
    ag_scope_end(tape, mark, &x, 1);
    return x;
}

ag_value *nn_decode(ag_tape *tape, const nn_model *model, ag_value *code)
{
    const nn_layers *l = model->layers;
    const int levels = model->arch.g_levels;
    if (!is_one(tape, model) || !code) return NULL;
    ts_mark mark = ag_scope_begin(tape);
    ag_value *x = layer(tape, model, l->decoder[levels][0], code);
    for (int i = levels - 1; i >= 0; i--) {
        x = layer(tape, model, l->decoder[i][0], ag_upsample(tape, x));
        x = layer(tape, model, l->decoder[i][1], x);
    }
    x = ag_tanh(tape, nn_conv(tape, model, l->decoded, x, 1, TS_PAD_REPLICATE, 1));
    ag_scope_end(tape, mark, &x, 1);
    return x;
}
