/* The auto-encoder of maps: a plain convolutional one, without skips, so that everything passes through the code. */
#include "nn/coder.h"
#include "nn/layers.h"
#include "ops.h"
#include "tensor/maps.h"
#include <math.h>
#include <stdio.h>

ts_code nn_coder_check(const nn_coder *c, ts_status *st)
{
    const struct {
        const char *key;
        int value, lo, hi;
    } of[] = {{"code", c->code, 1, 1024},
              {"width", c->width, 1, 1024},
              {"width_max", c->width_max, c->width, 4096},
              {"levels", c->levels, 1, NN_MAX_LEVELS}};
    for (int i = 0; i < 4; i++)
        if (of[i].value < of[i].lo || of[i].value > of[i].hi)
            return ts_fail(st, TS_INVALID, "coder.%s is %d: it must be %d to %d", of[i].key, of[i].value, of[i].lo,
                           of[i].hi);
    return TS_OK;
}

static int level_width(const nn_coder *c, int level)
{
    const int64_t w = (int64_t)c->width << level;
    return w < c->width_max ? (int)w : c->width_max;
}

/* The encoder pools between its convolutions; the decoder has two a level, since it alone has to make the detail. */
nn_model *nn_coder_plan(const nn_coder *c, ts_status *st)
{
    nn_model *m = nn_coder_check(c, st) == TS_OK ? nn_model_empty(st) : NULL;
    if (!m) return NULL;
    nn_layers *l = m->layers;
    const double gain = sqrt(2 / (1 + (double)NN_LEAK_G * (double)NN_LEAK_G)); /* what a leaky ReLU follows */
    char name[64];
    m->coder = *c;
    for (int i = 0; i <= c->levels; i++) {
        snprintf(name, sizeof name, "a.encoder%d", i);
        l->encoder[i] = nn_plan_conv(m, name, level_width(c, i), i ? level_width(c, i - 1) : MAP_CHANNELS, gain);
    }
    l->code = nn_plan_conv(m, "a.code", c->code, level_width(c, c->levels), 1);
    for (int i = c->levels, in = c->code; i >= 0; i--)
        for (int j = 0; j < (i < c->levels ? 2 : 1); j++, in = level_width(c, i)) {
            snprintf(name, sizeof name, "a.decoder%d.conv%d", i, j + 1);
            l->decoder[i][j] = nn_plan_conv(m, name, level_width(c, i), in, gain);
        }
    l->decoded = nn_plan_conv(m, "a.output", MAP_CHANNELS, level_width(c, 0), 0.25);
    for (int part = NN_H; part <= NN_COARSE + 1; part++) l->first[part] = m->params;
    return m;
}

nn_model *nn_coder_create(const nn_coder *c, ts_status *st) { return nn_model_zero(nn_coder_plan(c, st), st); }

static ag_value *layer(ag_tape *tape, const nn_model *model, nn_layer l, ag_value *x)
{
    return nn_conv(tape, model, l, x, 1, TS_PAD_REPLICATE, NN_LEAK_G);
}

static bool is_one(ag_tape *tape, const nn_model *model)
{
    if (model->coder.code > 0) return true;
    ag_fail(tape, TS_INVALID, "the model is no auto-encoder: it was not trained with coder.code");
    return false;
}

ag_value *nn_encode(ag_tape *tape, const nn_model *model, ag_value *maps)
{
    const nn_layers *l = model->layers;
    const int levels = model->coder.levels, unit = 1 << levels;
    if (!is_one(tape, model) || !maps) return NULL;
    const ts_shape s = maps->t.shape;
    if (s.h % unit || s.w % unit || s.c != MAP_CHANNELS)
        return ag_fail(tape, TS_INVALID,
                       "the auto-encoder takes %d channels and sides that are multiples of %d, not %d x %d x %d",
                       MAP_CHANNELS, unit, s.h, s.w, s.c);
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
    const int levels = model->coder.levels;
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
