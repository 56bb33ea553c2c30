/* A model to a file and back. */
#include "nn/weights.h"
#include "nn/layers.h"
#include "nn/published.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void dims_of(const nn_param *p, int64_t dim[4])
{
    for (int i = 0; i < 4; i++) dim[i] = p->dim[i];
}

static bool of_network(const char *name)
{
    return !strncmp(name, "g.", 2) || !strncmp(name, "h.", 2) || !strncmp(name, "a.", 2) || nn_published_tensor(name);
}

static bool finite_all(const float *v, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

nn_model *nn_model_load(const char *path, ts_status *st)
{
    nn_arch arch;
    nn_model *m = NULL;
    nn_file *f = nn_file_open(path, st);
    if (f && !nn_arch_from_file(f, &arch, st)) {
        m = nn_model_plan(&arch, st); /* before memory is taken: is the file what its metadata says? */
        for (int i = 0; m && i < nn_file_count(f); i++) {
            const char *name = nn_file_name(f, i);
            if (of_network(name) && !nn_model_find(m, name)) {
                ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" does not belong to the architecture that the file states", path, name);
                nn_model_free(&m);
            }
        }
        for (int i = 0; m && i < m->params; i++)
            if (!nn_file_has(f, m->param[i].name)) {
                ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" is missing", path, m->param[i].name);
                nn_model_free(&m);
            }
        if (m) {
            nn_model_free(&m);
            m = nn_model_create(&arch, st);
        }
        for (int i = 0; m && i < m->params; i++) {
            const nn_param *p = &m->param[i];
            int64_t dim[4];
            dims_of(p, dim);
            ts_code code = nn_file_read(f, p->name, p->rank, dim, m->value + p->offset, st);
            if (!code && !finite_all(m->value + p->offset, p->count))
                code = ts_fail(st, TS_NUMERIC, "%s: tensor \"%s\" holds a value that is not finite", path, p->name);
            if (code) nn_model_free(&m);
        }
    }
    nn_file_close(&f);
    return m;
}

ts_code nn_model_save(const nn_model *model, const float *values, const char *path, const nn_meta *extra, int extras, ts_status *st)
{
    char text[NN_ARCH_TEXT];
    nn_block *block = malloc((size_t)model->params * sizeof *block);
    nn_meta *meta = malloc((NN_ARCH_META + (size_t)extras) * sizeof *meta);
    ts_code code = TS_OK;
    if (!block || !meta) code = ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    for (int i = 0; !code && i < model->params; i++) {
        const nn_param *p = &model->param[i];
        block[i] = (nn_block){.name = p->name, .rank = p->rank, .data = values + p->offset};
        dims_of(p, block[i].dim);
        if (!finite_all(values + p->offset, p->count))
            code = ts_fail(st, TS_NUMERIC, "%s: not written: parameter \"%s\" holds a value that is not finite", path, p->name);
    }
    if (!code) {
        int metas = nn_arch_to_meta(&model->arch, meta, NN_ARCH_META, text, sizeof text);
        for (int i = 0; i < extras; i++) meta[metas++] = extra[i];
        code = nn_safetensors_write(path, block, model->params, meta, metas, st);
    }
    free(block);
    free(meta);
    return code;
}

/* A layer that reads every photograph begins as a model of one photograph has it, for the first of them, and blind to the others. False where the
 * file has no such tensor. */
static bool widened(const nn_model *model, int index, nn_file *f)
{
    const nn_layers *l = model->layers;
    const nn_param *p = &model->param[index];
    const int images = model->arch.images, in = p->dim[1];
    const bool refiner = model->arch.h_width > 0 && index == l->cell[0].conv.weight;
    const int first = refiner ? model->arch.channels : 0, each = (in - first) / images; /* h reads the maps, then the gradients */
    if (images == 1 || !(refiner || index == l->input_conv.weight || index == l->input_global.weight ||
                         (model->arch.descent == NN_DESCENT_GRADIENT && nn_arch_refines(&model->arch) && index == l->h_path.weight)))
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
                v[((size_t)o * (size_t)in + (size_t)c) * kernel + k] = blind ? 0 : one[(size_t)o * single + (size_t)c * kernel + k];
            }
    free(one);
    return fine;
}

ts_code nn_model_init_from(nn_model *model, const char *path, int *taken, int *left, ts_status *st)
{
    nn_file *f = nn_file_open(path, st);
    if (!f) return st ? st->code : TS_IO;
    *taken = *left = 0;
    ts_code code = TS_OK;
    for (int i = 0; i < model->params && !code; i++) {
        const nn_param *p = &model->param[i];
        int64_t dim[4];
        dims_of(p, dim);
        if (nn_file_read(f, p->name, p->rank, dim, model->value + p->offset, NULL) && !widened(model, i, f)) ++*left;
        else if (!finite_all(model->value + p->offset, p->count))
            code = ts_fail(st, TS_NUMERIC, "%s: tensor \"%s\" holds a value that is not finite", path, p->name);
        else ++*taken;
    }
    if (!code && *taken == 0) code = ts_fail(st, TS_FORMAT, "%s: no tensor has the name and shape of one of the model's", path);
    nn_file_close(&f);
    return code;
}
