/* A model starts from the parameters of another one, which may read fewer photographs, or have a narrower or a deeper
 * g. */
#include "nn/layers.h"
#include "nn/weights/weights.h"
#include "tensor/rng.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where the parameters come from. */
typedef struct source {
    nn_file *file;
    const nn_model *stated; /* the list of parameters that the file states; NULL: it states none */
    bool grows;             /* g may have more channels, or fewer levels, than the file's */
    bool no_memory;
} source;

/* A tensor of the file, which the caller frees; NULL: there is none, or no memory. */
static float *read_tensor(source *from, const char *name, int rank, const int64_t dim[4])
{
    size_t count = 1;
    for (int i = 0; i < rank; i++) count *= (size_t)dim[i];
    float *values = malloc(count * sizeof *values);
    const ts_code code = values ? nn_file_read(from->file, name, rank, dim, values, NULL) : TS_NOMEM;
    from->no_memory |= code == TS_NOMEM;
    if (!code) return values;
    free(values);
    return NULL;
}

static float *read_stated(source *from, const nn_param *q)
{
    int64_t dim[4];
    nn_param_dims(q, dim);
    return read_tensor(from, q->name, q->rank, dim);
}

/* A layer of h that reads every photograph begins as a model of one photograph has it, for the first of them, and with
 * weights of zero for the others. False where the file has no such tensor. */
static bool with_more_photographs(const nn_model *model, int index, source *from)
{
    const nn_layers *l = model->layers;
    const nn_param *p = &model->param[index];
    const int images = model->arch.images, in = p->dim[1];
    const bool refiner = (l->h.width > 0 && index == l->h.cell[0].conv.weight) ||
        (l->coarse.width > 0 && index == l->coarse.cell[0].conv.weight);
    const bool descends = model->arch.descent == NN_DESCENT_GRADIENT &&
        ((nn_arch_refines_full(&model->arch) && index == l->h.descent.weight) ||
         (model->arch.coarse_steps > 0 && index == l->coarse.descent.weight));
    const int first = refiner ? model->arch.channels : 0,
              each = (in - first) / images; /* h reads the maps, then the gradients */
    if (images == 1 || !(refiner || descends)) return false;
    const size_t kernel = (size_t)p->dim[2] * (size_t)p->dim[3], row = (size_t)in * kernel,
                 single = (size_t)(first + each) * kernel;
    float *one = read_tensor(from, p->name, p->rank, (int64_t[4]){p->dim[0], first + each, p->dim[2], p->dim[3]});
    float *v = model->value + p->offset;
    for (size_t o = 0; one && o < (size_t)p->dim[0]; o++)
        for (size_t k = 0; k < row; k++) v[o * row + k] = k < single ? one[o * single + k] : 0;
    const bool fine = one;
    free(one);
    return fine;
}

/* Which channel c of what g reads is in the file's g: -1: it has none. What is read are the photographs, as squares of
 * pixels one pixel of all after the other, coordinates where there are squares, and conditions of each photograph. */
static int seen_there(const nn_arch *there, const nn_arch *here, int c)
{
    const int squares = here->g_unshuffle * here->g_unshuffle, old = there->g_unshuffle * there->g_unshuffle,
              colours = 3 * here->images, had = 3 * there->images;
    if (c < colours * squares) {
        const int pixel = c / colours, colour = c % colours;
        return colour < had ? (old > 1 ? pixel * had : 0) + colour : -1;
    }
    c -= colours * squares;
    const int coordinates = squares > 1 ? NN_COORDINATES : 0, coordinates_there = old > 1 ? NN_COORDINATES : 0;
    if (c < coordinates) return coordinates_there ? had * old + c : -1;
    c -= coordinates;
    return there->conditions && c < NN_CONDITIONS * there->images ? had * old + coordinates_there + c : -1;
}

/* The layers that read what g sees. One that reads squares of pixels begins as a model that reads their mean has it,
 * and what the file's g does not see has weights of zero. False where the file has no such tensor. */
static bool with_other_inputs(const nn_model *model, int index, source *from)
{
    const nn_layers *l = model->layers;
    const nn_arch *here = &model->arch, *there = from->stated ? &from->stated->arch : NULL;
    const nn_param *p = &model->param[index];
    if (!there ||
        !(index == l->input_conv.weight || index == l->input_global.weight ||
          (here->g_unshuffle > 1 && index == l->detail[0].weight)))
        return false;
    const nn_param *q = nn_model_find(from->stated, p->name);
    const bool mean = here->g_unshuffle > 1 && there->g_unshuffle == 1;
    if (!q || (!mean && here->g_unshuffle != there->g_unshuffle) || q->dim[2] != p->dim[2] || q->dim[3] != p->dim[3] ||
        there->compat != here->compat || !(from->grows ? q->dim[0] <= p->dim[0] : q->dim[0] == p->dim[0]))
        return false;
    const int squares = mean ? here->g_unshuffle * here->g_unshuffle : 1, read = p->dim[1], had = q->dim[1];
    const size_t kernel = p->rank == 4 ? (size_t)p->dim[2] * (size_t)p->dim[3] : 1;
    float *old = read_stated(from, q), *v = model->value + p->offset;
    for (int o = 0; old && o < p->dim[0]; o++)
        for (int c = 0; c < read; c++) {
            const int at = seen_there(there, here, c),
                      colours = 3 * here->images * here->g_unshuffle * here->g_unshuffle;
            const float share = c < colours ? 1.0f / (float)squares : 1;
            float *to = v + ((size_t)o * (size_t)read + (size_t)c) * kernel;
            const float *of = old + ((size_t)(o % q->dim[0]) * (size_t)had + (size_t)(at < 0 ? 0 : at)) * kernel;
            for (size_t k = 0; k < kernel; k++) to[k] = at < 0 ? 0 : share * of[k];
        }
    const bool fine = old;
    free(old);
    return fine;
}

/* The last layer of detail, which writes more channels than the file's, begins with zeros there. False where the file
 * has no such tensor. */
static bool with_more_written(const nn_model *model, int index, source *from)
{
    const nn_layers *l = model->layers;
    const nn_param *p = &model->param[index], *q = nn_model_find(from->stated, p->name);
    if (!q || model->arch.g_unshuffle == 1 || !(index == l->detail[4].weight || index == l->detail[4].bias) ||
        q->dim[0] > p->dim[0])
        return false;
    for (int i = 1; i < 4; i++)
        if (q->dim[i] != p->dim[i]) return false;
    float *old = read_stated(from, q), *v = model->value + p->offset;
    for (size_t i = 0; old && i < p->count; i++) v[i] = i < q->count ? old[i] : 0;
    const bool fine = old;
    free(old);
    return fine;
}

/* Channels that a layer reads: one after the other those of one or two others, in the file and in the model. */
typedef struct inputs {
    int parts, from[2], to[2];
} inputs;

static bool may_grow(const nn_arch *narrow, const nn_arch *wide)
{
    return narrow->g_width <= wide->g_width && narrow->g_width_max <= wide->g_width_max &&
        (narrow->g_unshuffle == 1 ||
         (narrow->g_unshuffle == wide->g_unshuffle && narrow->g_detail <= wide->g_detail)) &&
        (narrow->g_half == 0 || narrow->g_half == wide->g_half) && narrow->g_levels >= wide->g_levels &&
        narrow->g_kernel == wide->g_kernel && narrow->g_kernel_first == wide->g_kernel_first &&
        narrow->images == wide->images && narrow->compat == NN_COMPAT_NONE && wide->compat == NN_COMPAT_NONE;
}

/* What a file of that architecture calls parameter p: the way up is counted from below, where a deeper g has levels
 * that this one lacks. there: NULL where it says none; room: as long as a name. */
static const char *name_there(const nn_model *model, const nn_arch *there, const nn_param *p, char *room)
{
    static const char up[] = "g.up";
    const int more = there ? there->g_levels - model->arch.g_levels : 0;
    if (more <= 0 || strncmp(p->name, up, sizeof up - 1) != 0) return p->name;
    char *rest;
    const long level = strtol(p->name + sizeof up - 1, &rest, 10);
    snprintf(room, sizeof p->name, "%s%ld%s", up, level + more, rest);
    return room;
}

static inputs inputs_of(const nn_model *model, const nn_arch *narrow, int index, const int *from, const int *to)
{
    const nn_layers *l = model->layers;
    const int levels = model->arch.g_levels;
    for (int i = 0; i < levels; i++) {
        if (index == l->up[i].conv1.weight) { /* [skip, what comes from below] */
            const int skip_from = nn_level_width(narrow, levels - 1 - i),
                      skip_to = nn_level_width(&model->arch, levels - 1 - i);
            return (inputs){2, {skip_from, from[1] - skip_from}, {skip_to, to[1] - skip_to}};
        }
        if (index == l->down[i].global.weight || index == l->up[i].global.weight) /* [mean of the features, global] */
            return (inputs){2, {from[0], from[1] - from[0]}, {to[0], to[1] - to[0]}};
    }
    if (index == l->detail[1].weight && model->arch.g_unshuffle > 1) /* [squares, the U-Net's features] */
        return (inputs){
            2, {narrow->g_detail, from[1] - narrow->g_detail}, {model->arch.g_detail, to[1] - model->arch.g_detail}};
    return (inputs){1, {from[1], 0}, {to[1], 0}};
}

/* A tensor of g starts from that of a narrower g (Chen, Goodfellow, Shlens, "Net2Net", ICLR 2016, section 2.2): channel
 * j is the narrow one's j mod c, and the layers that read it read its copies, each with a random share of the weight,
 * so that training separates them. The network computes the same as the narrow one. name: of the tensor in the file.
 * False where it has no such tensor. */
static bool grown(const nn_model *model, int index, const char *name, source *from)
{
    const nn_param *p = &model->param[index];
    const nn_param *q = nn_model_find(from->stated, name);
    if (!q || strncmp(p->name, "g.", 2) != 0) return false;
    for (int i = 0; i < 4; i++)
        if (i < 2 ? q->dim[i] > p->dim[i] : q->dim[i] != p->dim[i]) return false;
    float *old = read_stated(from, q), *v = model->value + p->offset;
    const bool fine = old;
    const size_t kernel = p->rank == 4 ? (size_t)p->dim[2] * (size_t)p->dim[3] : 1;
    const inputs in = p->rank > 1 ? inputs_of(model, &from->stated->arch, index, q->dim, p->dim)
                                  : (inputs){1, {1, 0}, {1, 0}};
    const int64_t row = (int64_t)in.from[0] + in.from[1];
    ts_rng rng = ts_rng_make(1, TS_STREAM_INIT, (uint64_t)index);
    for (int o = 0; fine && o < p->dim[0]; o++)
        for (int part = 0, from0 = 0, to0 = 0; part < in.parts; from0 += in.from[part], to0 += in.to[part++])
            for (int c = 0; c < in.from[part]; c++) {
                double left = 1;
                for (int j = c; j < in.to[part]; j += in.from[part]) {
                    const int copies = (in.to[part] - 1 - j) / in.from[part] + 1; /* with this one */
                    const double share = copies == 1 ? left : left * (0.5 + (double)ts_rng_uniform(&rng)) / copies;
                    const float *a = old + ((o % q->dim[0]) * row + from0 + c) * (int64_t)kernel;
                    float *to = v + ((size_t)o * (size_t)(in.to[0] + in.to[1]) + (size_t)(to0 + j)) * kernel;
                    for (size_t k = 0; k < kernel; k++) to[k] = (float)(share * (double)a[k]);
                    left -= share;
                }
            }
    free(old);
    return fine;
}

/* Parameter i, if the file has it. */
static bool take(nn_model *model, int i, source *from)
{
    const nn_param *p = &model->param[i];
    int64_t dim[4];
    char room[sizeof p->name];
    const char *name = name_there(model, from->stated ? &from->stated->arch : NULL, p, room);
    nn_param_dims(p, dim);
    if (with_other_inputs(model, i, from)) return true;
    return !nn_file_read(from->file, name, p->rank, dim, model->value + p->offset, NULL) ||
        with_more_photographs(model, i, from) ||
        (from->grows && (with_more_written(model, i, from) || grown(model, i, name, from)));
}

ts_code nn_model_init_from(nn_model *model, const char *path, bool *begun, int *taken, int *left, ts_status *st)
{
    source from = {.file = nn_file_open(path, st)};
    if (!from.file) return st ? st->code : TS_IO;
    *taken = *left = 0;
    nn_arch arch;
    ts_status why = {0};
    nn_model *stated = NULL;
    ts_code code = TS_OK;
    if (!nn_arch_from_file(from.file, &arch, &why)) {
        from.stated = stated = nn_model_plan(&arch, &why);
        from.grows = stated && may_grow(&arch, &model->arch);
    }
    from.no_memory = why.code == TS_NOMEM;
    for (int i = 0; i < model->params && !code; i++) {
        const nn_param *p = &model->param[i];
        if (begun && begun[i]) continue;
        const bool took = take(model, i, &from);
        if (from.no_memory) code = ts_fail(st, TS_NOMEM, "%s: out of memory for its tensors", path);
        else if (!took) ++*left;
        else if (!nn_all_finite(model->value + p->offset, p->count))
            code = ts_fail(st, TS_NUMERIC, "%s: tensor \"%s\" holds a value that is not finite", path, p->name);
        else {
            ++*taken;
            if (begun) begun[i] = true;
        }
    }
    if (!code && *taken == 0)
        code = ts_fail(st, TS_FORMAT, "%s: no tensor has the name and shape of one of the model's%s", path,
                       begun ? " that is still as it was drawn" : "");
    nn_model_free(&stated);
    nn_file_close(&from.file);
    return code;
}
