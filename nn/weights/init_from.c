/* A model starts from the parameters of another one, which may read fewer photographs, or have a narrower or a deeper
 * g. */
#include "nn/layers.h"
#include "nn/weights/weights.h"
#include "tensor/rng.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A layer that reads every photograph begins as a model of one photograph has it, for the first of them, and with
 * weights of zero for the others. False where the file has no such tensor. */
static bool with_more_photographs(const nn_model *model, int index, nn_file *f)
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
    if (images == 1 || !(refiner || index == l->input_conv.weight || index == l->input_global.weight || descends))
        return false;
    const size_t kernel = (size_t)p->dim[2] * (size_t)p->dim[3], single = (size_t)(first + each) * kernel;
    float *one = malloc((size_t)p->dim[0] * single * sizeof *one);
    const int64_t dim[4] = {p->dim[0], first + each, p->dim[2], p->dim[3]};
    const bool fine = one && !nn_file_read(f, p->name, p->rank, dim, one, NULL);
    float *v = model->value + p->offset;
    for (int o = 0; fine && o < p->dim[0]; o++)
        for (int c = 0; c < in; c++)
            for (size_t k = 0; k < kernel; k++) {
                const bool blind = c >= first + each;
                v[((size_t)o * (size_t)in + (size_t)c) * kernel + k] = blind
                    ? 0
                    : one[(size_t)o * single + (size_t)c * kernel + k];
            }
    free(one);
    return fine;
}

/* A first layer that reads squares of pixels begins as a model that reads their mean has it; one that reads further
 * channels begins with weights of zero for them, and one that writes further ones begins with zeros there. stated: the
 * list of parameters that the file states. False where the file has no such tensor. */
static bool with_more_channels(const nn_model *model, const nn_model *stated, int index, nn_file *f)
{
    const nn_layers *l = model->layers;
    const nn_param *p = &model->param[index], *q = nn_model_find(stated, p->name);
    const bool reads = index == l->input_conv.weight || index == l->input_global.weight || index == l->detail[0].weight;
    const bool writes = model->arch.g_unshuffle > 1 && (index == l->detail[4].weight || index == l->detail[4].bias);
    if (!q || (!reads && !writes) || q->dim[0] > p->dim[0] || q->dim[1] > p->dim[1] ||
        (reads && q->dim[0] != p->dim[0]))
        return false;
    const int colours = 3 * model->arch.images, squares = model->arch.g_unshuffle * model->arch.g_unshuffle;
    const bool mean = reads && squares > 1 && stated->arch.g_unshuffle == 1;
    const size_t kernel = p->rank == 4 ? (size_t)p->dim[2] * (size_t)p->dim[3] : 1;
    const int read = p->rank > 1 ? p->dim[1] : 1, had = p->rank > 1 ? q->dim[1] : 1;
    int64_t dim[4];
    nn_param_dims(q, dim);
    float *old = malloc(q->count * sizeof *old), *v = model->value + p->offset;
    const bool fine = old && !nn_file_read(f, q->name, q->rank, dim, old, NULL);
    for (int o = 0; fine && o < p->dim[0]; o++)
        for (int c = 0; c < read; c++)
            for (size_t k = 0; k < kernel; k++) {
                const int from = mean ? c < colours * squares ? c % colours : had : c;
                const bool has = o < q->dim[0] && from < had;
                const float share = mean ? 1.0f / (float)squares : 1;
                v[((size_t)o * (size_t)read + (size_t)c) * kernel + k] = has
                    ? share * old[((size_t)o * (size_t)had + (size_t)from) * kernel + k]
                    : 0;
            }
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
        (narrow->g_unshuffle == 1 || narrow->g_detail <= wide->g_detail) &&
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
 * so that training separates them. The network computes the same as the narrow one. narrow: the list of parameters that
 * the file states, name: of this one there. False where it has no such tensor. */
static bool grown(const nn_model *model, const nn_model *narrow, int index, const char *name, nn_file *f)
{
    const nn_param *p = &model->param[index];
    const nn_param *q = nn_model_find(narrow, name);
    if (!q || strncmp(p->name, "g.", 2) != 0) return false;
    for (int i = 0; i < 4; i++)
        if (i < 2 ? q->dim[i] > p->dim[i] : q->dim[i] != p->dim[i]) return false;
    int64_t dim[4];
    nn_param_dims(q, dim);
    float *old = malloc(q->count * sizeof *old), *v = model->value + p->offset;
    const bool fine = old && !nn_file_read(f, q->name, q->rank, dim, old, NULL);
    const size_t kernel = p->rank == 4 ? (size_t)p->dim[2] * (size_t)p->dim[3] : 1;
    const inputs in = p->rank > 1 ? inputs_of(model, &narrow->arch, index, q->dim, p->dim)
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

ts_code nn_model_init_from(nn_model *model, const char *path, bool *begun, int *taken, int *left, ts_status *st)
{
    nn_file *f = nn_file_open(path, st);
    if (!f) return st ? st->code : TS_IO;
    *taken = *left = 0;
    nn_arch stated;
    const bool says = !nn_arch_from_file(f, &stated, NULL);
    nn_model *narrow = says && may_grow(&stated, &model->arch) ? nn_model_plan(&stated, NULL) : NULL;
    ts_code code = TS_OK;
    for (int i = 0; i < model->params && !code; i++) {
        const nn_param *p = &model->param[i];
        int64_t dim[4];
        char room[sizeof p->name];
        const char *name = name_there(model, says ? &stated : NULL, p, room);
        if (begun && begun[i]) continue;
        nn_param_dims(p, dim);
        if (nn_file_read(f, name, p->rank, dim, model->value + p->offset, NULL) &&
            !with_more_photographs(model, i, f) && !(narrow && with_more_channels(model, narrow, i, f)) &&
            !(narrow && grown(model, narrow, i, name, f)))
            ++*left;
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
    nn_model_free(&narrow);
    nn_file_close(&f);
    return code;
}
