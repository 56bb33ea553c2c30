/* The list of parameters and the blocks that hold them. */
#include "nn/layers.h"
#include "nn/weights/file.h"
#include "nn/weights/published.h"
#include "ops.h"
#include "tensor/maps.h"
#include "tensor/memory.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Parameters of the largest model: 8 levels, two blocks of 11 each, and the layers before and after them. */
enum { MAX_PARAMS = 4 + 2 * 11 * NN_MAX_LEVELS + 6 + 2 * 14 + 10 + 4 * NN_MAX_LEVELS + 4 + 30 };

static nn_layers *layers_of(const nn_model *m) { return m->layers; }

static int add(nn_model *m, const char *layer, const char *what, int rank, const int *dim, double start)
{
    nn_param *p = &m->param[m->params];
    char theirs[64];
    if (m->arch.compat == NN_COMPAT_PUBLISHED && nn_published_name(layer, theirs, sizeof theirs)) layer = theirs;
    snprintf(p->name, sizeof p->name, "%s.%s", layer, what);
    p->rank = rank;
    p->count = 1;
    for (int i = 0; i < 4; i++) {
        p->dim[i] = i < rank ? dim[i] : 1;
        p->count *= (size_t)p->dim[i];
    }
    p->offset = m->count;
    m->count += (p->count + 15) / 16 * 16;
    layers_of(m)->start[m->params] = start;
    return m->params++;
}

/* gain: standard deviation of the output for an input of standard deviation 1. */
static nn_layer conv(nn_model *m, const char *name, int oc, int ic, int k, bool bias, double gain)
{
    nn_layer l;
    l.weight = add(m, name, "weight", 4, (int[]){oc, ic, k, k}, gain / sqrt((double)ic * k * k));
    l.bias = bias ? add(m, name, "bias", 1, &oc, 0) : -1;
    return l;
}

nn_layer nn_plan_conv(nn_model *m, const char *name, int oc, int ic, double gain)
{
    return conv(m, name, oc, ic, 3, true, gain);
}

static nn_layer linear(nn_model *m, const char *name, int out, int in, double gain)
{
    nn_layer l;
    l.weight = add(m, name, "weight", 2, (int[]){out, in}, gain / sqrt(in));
    l.bias = add(m, name, "bias", 1, &out, 0);
    return l;
}

/* Kaiming's factors (He et al., "Delving Deep into Rectifiers", ICCV 2015, eq. 15); SELU keeps a unit variance with
 * gain 1 (Klambauer et al., "Self-Normalizing Neural Networks", NIPS 2017). */
static double leaky_gain(double leak) { return sqrt(2 / (1 + leak * leak)); }

/* A linear layer of a block, called way and number. */
static nn_layer block_linear(nn_model *m, const char *way, int number, const char *what, int out, int in, double gain)
{
    char name[64];
    snprintf(name, sizeof name, "g.%s%d.%s", way, number, what);
    return linear(m, name, out, in, gain);
}

static nn_unet_block unet_block(nn_model *m, const char *way, int number, int in, int middle, int out, int global,
                                int k)
{
    char name[64];
    nn_unet_block b;
    const bool published = m->arch.compat == NN_COMPAT_PUBLISHED, up = way[0] == 'u';
    double gain = leaky_gain(NN_LEAK_G);
    for (int pass = 0; pass < 3;
         pass++) /* the published order is: linears of the way down, those of the way up, convolutions */
        if (pass == (published ? 2 : 0)) {
            snprintf(name, sizeof name, "g.%s%d.conv1", way, number);
            b.conv1 = conv(m, name, middle, in, k, true, 1); /* conv2 follows at once */
            snprintf(name, sizeof name, "g.%s%d.conv2", way, number);
            b.conv2 = conv(m, name, out, middle, k, false, gain);
        } else if (pass == (published ? up : 1)) {
            b.add = block_linear(m, way, number, "add", out, global,
                                 gain / sqrt(2)); /* one of two summands: the features themselves have unit variance */
            b.global = block_linear(m, way, number, "global", out, out + global, 1);
        } else if (published) { /* made, kept in files, never read */
            const int other = up ? in : in / 2;
            block_linear(m, way, number, "unused1", out, other, 0);
            block_linear(m, way, number, "unused2", out, out + other, 0);
        }
    return b;
}

int nn_level_width(const nn_arch *a, int level)
{
    int64_t w = (int64_t)a->g_width << level;
    return w < a->g_width_max ? (int)w : a->g_width_max;
}

const signed char nn_spread_of[] = {0, 0, 0, 1, 1, 2, 3, 3, 3};

int nn_detail_writes(const nn_arch *a) { return a->channels + NN_FRAME + (a->spread ? NN_SPREADS : 0); }

int nn_g_reads(const nn_arch *a)
{
    const int squares = a->g_unshuffle * a->g_unshuffle;
    return 3 * a->images * squares + (squares > 1 ? NN_COORDINATES : 0) +
        (a->conditions ? NN_CONDITIONS * a->images : 0);
}

/* The U-Net's features and what it read, to squares of NN_FINE channels, and these to what is added at the full
 * size. */
static void plan_detail(nn_model *m)
{
    const nn_arch *a = &m->arch;
    nn_layers *l = m->layers;
    const double gain = leaky_gain(NN_LEAK_G);
    l->detail[0] = conv(m, "g.detail.conv1", a->g_detail, nn_g_reads(a), 3, true, gain);
    l->detail[1] = conv(m, "g.detail.conv2", a->g_detail, a->g_detail + nn_level_width(a, 0), 3, true, gain);
    l->detail[2] = conv(m, "g.detail.conv3", NN_FINE * a->g_unshuffle * a->g_unshuffle, a->g_detail, 1, true, gain);
    for (int i = 0; i < a->g_trunk; i++) {
        char name[64];
        snprintf(name, sizeof name, "g.trunk%d.conv1", i + 1);
        l->trunk[i][0] = conv(m, name, a->g_detail, a->g_detail, 3, true, gain);
        snprintf(name, sizeof name, "g.trunk%d.conv2", i + 1);
        l->trunk[i][1] = conv(m, name, a->g_detail, a->g_detail, 3, false, 0); /* nothing at first */
    }
    if (a->g_half > 0) {
        const int r = a->g_unshuffle / 2, w = a->g_half;
        l->half[0] = conv(m, "g.half.conv1", w * r * r, a->g_detail, 1, true, gain);
        l->half[1] = conv(m, "g.half.conv2", w, w + NN_HALF_READS, 3, true, gain);
        l->half[2] = conv(m, "g.half.conv3", w, w, 3, true, gain);
        l->half[3] = conv(m, "g.half.conv4", w, w, 3, false, 1);
        l->half[4] = conv(m, "g.half.conv5", 4 * NN_FINE, w, 1, false, 0); /* nothing at first */
    }
    l->detail[3] = conv(m, "g.detail.conv4", NN_FINER, NN_FINE + 3 + NN_COORDINATES, 3, true, gain);
    l->detail[4] = conv(m, "g.detail.conv5", nn_detail_writes(a), NN_FINER, 3, true, 0);
}

static void plan_g(nn_model *m)
{
    const nn_arch *a = &m->arch;
    nn_layers *l = m->layers;
    int levels = a->g_levels, w0 = nn_level_width(a, 0);
    l->input_conv = conv(m, "g.input.conv", w0, nn_g_reads(a), 3, true, leaky_gain(NN_LEAK_G));
    l->input_global = linear(m, "g.input.global", w0, nn_g_reads(a), 1);
    for (int i = 1; i <= levels; i++) {
        int in = nn_level_width(a, i - 1), out = nn_level_width(a, i);
        l->down[i - 1] = unet_block(m, "down", i, in, out, out, in, i == 1 ? a->g_kernel_first : a->g_kernel);
    }
    for (int i = 1, deep = nn_level_width(a, levels); i <= levels; i++) {
        int skip = nn_level_width(a, levels - i), out = i < levels ? nn_level_width(a, levels - i - 1) : w0;
        l->up[i - 1] = unet_block(m, "up", i, skip + deep, (skip + deep) / 2, out, deep, a->g_kernel);
        deep = out;
    }
    /* R_0 starts near the middle of every map's range, where tanh still has a slope. */
    l->output_conv1 = conv(m, "g.output.conv1", a->channels, w0, 3, true, 1);
    l->output_conv2 = conv(m, "g.output.conv2", a->channels, a->channels, 3, true, 0.25);
    l->output_add = linear(m, "g.output.add", a->channels, w0, 0.25);
    if (a->g_unshuffle > 1) plan_detail(m);
    if (!a->scene) return;
    enum { HIDDEN = 64 };
    l->scene[0] = linear(m, "g.scene.hidden", HIDDEN, nn_level_width(a, levels), 1);
    l->scene[1] = linear(m, "g.scene.numbers", 2 * RD_SCENE_NUMBERS, HIDDEN, 0);
}

/* name: what the parameters' names begin with. */
static void plan_refiner(nn_model *m, const char *name, int width, int gru, nn_refiner *h)
{
    const nn_arch *a = &m->arch;
    nn_layers *l = m->layers;
    const double gain = leaky_gain(NN_LEAK_H);
    char full[64];
    *h = (nn_refiner){.width = width, .gru = gru, .descent = {-1, -1}};
    for (int i = 0; i < 2 && width > 0; i++) {
        nn_cell *c = &h->cell[i];
        const bool last = a->compat == NN_COMPAT_PUBLISHED; /* in the published order the convolution comes last */
        for (int pass = 0; pass < 2; pass++)
            if (pass == last) {
                snprintf(full, sizeof full, "%s.conv%d", name, i + 1);
                c->conv = conv(m, full, width, i ? gru : (1 + a->images) * a->channels, i ? 3 : 5, true, gain);
            } else {
                snprintf(full, sizeof full, "%s.gru%d.ih", name, i + 1);
                c->input = conv(m, full, 3 * gru, width, 1, true, 1);
                snprintf(full, sizeof full, "%s.gru%d.hh", name, i + 1);
                c->hidden = conv(m, full, 3 * gru, gru, 1, true, 1);
                l->start[c->hidden.weight] = NN_ORTHOGONAL;
            }
    }
    if (width > 0) {
        snprintf(full, sizeof full, "%s.output", name);
        h->output = conv(m, full, a->channels, gru, 3, false, 1);
        l->start[h->output.weight] = 1e-3; /* h starts as nothing, nearly */
    }
    if (a->descent == NN_DESCENT_NONE || a->descent == NN_DESCENT_POSTERIOR || !a->gradient) return;
    const bool newton = a->descent == NN_DESCENT_NEWTON;
    snprintf(full, sizeof full, "%s.%s", name, newton ? "newton" : "descent");
    h->descent = conv(m, full, a->channels, newton ? a->channels : a->images * a->channels, 1, false, 1);
    l->start[h->descent.weight] = newton ? NN_NEWTON_START : NN_DESCENT_START;
}

/* Two convolutions; side: of the first one's kernel. */
static void pair(nn_model *m, const char *name, int in, int out, int side, nn_layer layer[2])
{
    char full[64];
    for (int i = 0; i < 2; i++) {
        snprintf(full, sizeof full, "h.%s.conv%d", name, i + 1);
        layer[i] = conv(m, full, out, i ? out : in, i ? 3 : side, true, leaky_gain(NN_LEAK_G));
    }
}

static void plan_revise(nn_model *m)
{
    const nn_arch *a = &m->arch;
    nn_reviser *h = &((nn_layers *)m->layers)->revise;
    const int w = a->revise_width, squares = a->g_unshuffle * a->g_unshuffle, fine = NN_REVISION_FINE,
              level[NN_REVISE_LEVELS + 1] = {w, w * 3 / 2, w * 7 / 4};
    const double gain = leaky_gain(NN_LEAK_G);
    pair(m, "read", NN_REVISION_READS * squares, w, 1, h->read);
    for (int i = 0; i < NN_REVISE_LEVELS; i++) {
        char name[16];
        snprintf(name, sizeof name, "down%d", i + 1);
        pair(m, name, level[i], level[i + 1], 3, h->down[i]);
    }
    h->global = linear(m, "h.global", level[NN_REVISE_LEVELS], level[NN_REVISE_LEVELS], 1);
    for (int i = NN_REVISE_LEVELS; i-- > 0;) {
        char name[16];
        snprintf(name, sizeof name, "up%d", i + 1);
        pair(m, name, level[i] + level[i + 1], level[i], 1, h->up[i]);
    }
    h->squares = conv(m, "h.squares", NN_FINE * squares, w, 1, true, gain);
    h->full[0] = conv(m, "h.full.conv1", fine, NN_FINE + NN_REVISION_READS, 3, true, gain);
    h->full[1] = conv(m, "h.full.conv2", fine, fine, 3, true, gain);
    h->full[2] = conv(m, "h.full.conv3", MAP_CHANNELS + NN_SPREADS, fine, 3, true, 0); /* nothing at first */
}

nn_model *nn_model_empty(ts_status *st)
{
    nn_model *m = calloc(1, sizeof *m);
    nn_layers *l = m ? m->layers = calloc(1, sizeof *l) : NULL;
    if (l) {
        m->param = calloc(MAX_PARAMS, sizeof *m->param);
        l->start = calloc(MAX_PARAMS, sizeof *l->start);
    }
    if (!l || !m->param || !l->start) {
        nn_model_free(&m);
        ts_fail(st, TS_NOMEM, "no memory for the list of parameters");
    }
    return m;
}

nn_model *nn_model_plan(const nn_arch *arch, ts_status *st)
{
    nn_model *m = nn_arch_check(arch, st) == TS_OK ? nn_model_empty(st) : NULL;
    if (!m) return NULL;
    nn_layers *l = m->layers;
    m->arch = *arch;
    plan_g(m);
    l->first[NN_H] = m->params;
    if (nn_arch_refines_full(arch)) plan_refiner(m, "h", arch->h_width, arch->h_gru, &l->h);
    if (arch->revisions > 0) plan_revise(m);
    l->first[NN_COARSE] = m->params;
    if (arch->coarse_steps > 0) plan_refiner(m, "coarse", arch->coarse_width, arch->coarse_gru, &l->coarse);
    l->first[NN_COARSE + 1] = m->params;
    return m;
}

static size_t offset_of(const nn_model *m, int index) { return index < m->params ? m->param[index].offset : m->count; }

static float *block(size_t count, bool sparse, const char *what, ts_status *st)
{
    float *p = sparse ? ts_memory_sparse(count * sizeof *p) : ts_memory(count * sizeof *p);
    if (!p) ts_fail(st, TS_NOMEM, "no memory for the model's %s (%.0f MB)", what, (double)count * sizeof *p / 1e6);
    return p;
}

static float *zero_block(size_t count, const char *what, ts_status *st)
{
    float *p = block(count, false, what, st);
    if (p) ts_memory_clear(p, count * sizeof *p, 0);
    return p;
}

nn_model *nn_model_zero(nn_model *plan, ts_status *st)
{
    if (plan && !(plan->value = zero_block(plan->count, "parameters", st))) nn_model_free(&plan);
    return plan;
}

nn_model *nn_model_create(const nn_arch *arch, ts_status *st) { return nn_model_zero(nn_model_plan(arch, st), st); }

ts_code nn_model_allocate(nn_model *m, bool sparse, ts_status *st)
{
    m->value = block(m->count, sparse, "parameters", st);
    for (int i = 0; m->value && !sparse && i < m->params; i++) {
        const size_t end = m->param[i].offset + m->param[i].count;
        memset(m->value + end, 0, (offset_of(m, i + 1) - end) * sizeof *m->value);
    }
    return m->value ? TS_OK : st->code;
}

void nn_model_free(nn_model **model)
{
    nn_model *m = *model;
    if (!m) return;
    if (m->layers) free(layers_of(m)->start);
    free(m->layers);
    free(m->param);
    nn_file_close(&m->file);
    free(m->value);
    free(m->grad);
    free(m);
    *model = NULL;
}

ts_code nn_model_train(nn_model *model, ts_status *st)
{
    if (!model->grad) model->grad = zero_block(model->count, "gradients", st);
    return model->grad ? TS_OK : TS_NOMEM;
}

const void *nn_model_halves(const float *weight, void *model)
{
    const nn_model *m = model;
    for (int i = 0; i < m->params; i++)
        if (m->value + m->param[i].offset == weight) return m->param[i].half;
    return NULL;
}

const nn_param *nn_model_find(const nn_model *model, const char *name)
{
    for (int i = 0; i < model->params; i++)
        if (!strcmp(model->param[i].name, name)) return &model->param[i];
    return NULL;
}

void nn_model_range(const nn_model *model, nn_part part, size_t *first, size_t *last)
{
    *first = offset_of(model, layers_of(model)->first[part]);
    *last = offset_of(model, layers_of(model)->first[part + 1]);
}

ag_value *nn_parameter(ag_tape *tape, const nn_model *model, int index)
{
    if (index < 0) return NULL;
    const nn_param *p = &model->param[index];
    ts_shape s = {1, 1, 1, p->dim[0]};
    if (p->rank == 2) s = (ts_shape){1, 1, p->dim[0], p->dim[1]};
    if (p->rank == 4) s = (ts_shape){p->dim[0], p->dim[1], p->dim[2], p->dim[3]};
    int part = NN_G;
    while (index >= layers_of(model)->first[part + 1]) part++;
    float *grad = model->grad && !model->fixed[part] ? model->grad + p->offset : NULL;
    return ag_parameter(tape, ts_view(model->value + p->offset, s), grad);
}

ag_value *nn_conv_with_constants(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x, ag_value *constants,
                                 int dilation, ts_pad pad, float leak)
{
    return ag_conv_with_constants(tape, x, constants, nn_parameter(tape, model, layer.weight),
                                  nn_parameter(tape, model, layer.bias), dilation, pad, leak);
}

ag_value *nn_conv(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x, int dilation, ts_pad pad,
                  float leak)
{
    return nn_conv_with_constants(tape, model, layer, x, NULL, dilation, pad, leak);
}

ag_value *nn_conv_add(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *base, ag_value *x, int dilation,
                      ts_pad pad)
{
    return ag_conv_add(tape, base, x, nn_parameter(tape, model, layer.weight), nn_parameter(tape, model, layer.bias),
                       dilation, pad);
}

ag_value *nn_linear(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x)
{
    return ag_linear(tape, x, nn_parameter(tape, model, layer.weight), nn_parameter(tape, model, layer.bias));
}
