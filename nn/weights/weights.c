/* A model to a file and back. */
#include "nn/weights/weights.h"
#include "nn/layers.h"
#include "nn/weights/file_internal.h"
#include "nn/weights/published.h"
#include "tensor/team.h"
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

void nn_param_dims(const nn_param *p, int64_t dim[4])
{
    for (int i = 0; i < 4; i++) dim[i] = p->dim[i];
}

typedef struct search {
    const float *v;
    atomic_bool *bad;
} search;

static void find_bad(const void *job, int64_t begin, int64_t end)
{
    const search *s = job;
    int bad = 0;
    for (int64_t i = begin; i < end; i++) bad |= !(fabsf(s->v[i]) <= FLT_MAX);
    if (bad) atomic_store(s->bad, true);
}

bool nn_all_finite(const float *v, size_t count)
{
    atomic_bool bad = false;
    ts_for(0, (int64_t)count, 1 << 16, find_bad, &(search){v, &bad});
    return !bad;
}

static bool of_network(const char *name)
{
    return !strncmp(name, "g.", 2) || !strncmp(name, "h.", 2) || !strncmp(name, "coarse.", 7) ||
        !strncmp(name, "a.", 2) || nn_published_tensor(name);
}

/* Weights that can be taken from the file as they are stay there. False: they are to be read; or st. */
static bool leave_halves(const nn_file *f, nn_param *p, const int64_t dim[4], ts_status *st)
{
    const nn_tensor *e = p->rank > 1 ? nn_file_find_real(f, p->name, p->rank, dim, st) : NULL;
    const void *half = e ? nn_tensor_halves(e) : NULL;
    if (!half) return false;
    if (!nn_halves_finite(e))
        return ts_fail(st, TS_NUMERIC, "%s: tensor \"%s\" holds a value that is not finite", nn_file_path(f), p->name),
               false;
    p->half = half;
    return true;
}

typedef struct reading {
    const nn_file *f;
    nn_model *m;
    bool leave;
    pthread_mutex_t *lock; /* of what follows */
    int *failed;
    ts_status *st;
} reading;

static void read_value(const void *job, int64_t i)
{
    const reading *r = job;
    nn_param *p = &r->m->param[i];
    ts_status own = {0};
    int64_t dim[4];
    nn_param_dims(p, dim);
    if (r->leave && leave_halves(r->f, p, dim, &own)) return;
    if (!own.code && nn_file_read_finite(r->f, p->name, p->rank, dim, r->m->value + p->offset, &own) == TS_OK) return;
    pthread_mutex_lock(r->lock);
    if (i < *r->failed) {
        *r->failed = (int)i;
        *r->st = own;
    }
    pthread_mutex_unlock(r->lock);
}

/* A tensor by each thread at a time: they wait for each other once, not at every tensor, while another thread may be
 * decoding. Of several that fail st names the first. */
static ts_code read_values(const nn_file *f, nn_model *m, bool leave, ts_status *st)
{
    int failed = m->params;
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    ts_tasks(0, m->params, read_value, &(reading){f, m, leave, &lock, &failed, st});
    return failed < m->params ? st->code : TS_OK;
}

/* The plan with its parameters: all that are in the file, and no other tensors of a network. Frees the plan on failure.
 */
static nn_model *fill(nn_model *m, const nn_file *f, bool leave, ts_status *st)
{
    for (int i = 0; m && i < nn_file_count(f); i++) {
        const char *name = nn_file_name(f, i);
        if (of_network(name) && !nn_model_find(m, name)) {
            ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" does not belong to the architecture that the file states",
                    nn_file_path(f), name);
            nn_model_free(&m);
        }
    }
    for (int i = 0; m && i < m->params; i++)
        if (!nn_file_has(f, m->param[i].name)) {
            ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" is missing", nn_file_path(f), m->param[i].name);
            nn_model_free(&m);
        }
    if (m && (nn_model_allocate(m, leave, st) || read_values(f, m, leave, st))) nn_model_free(&m);
    return m;
}

nn_model *nn_model_load(const char *path, ts_status *st)
{
    nn_arch arch;
    nn_model *m = NULL;
    nn_file *f = nn_file_open(path, st);
    if (f && !nn_arch_from_file(f, &arch, st)) m = fill(nn_model_plan(&arch, st), f, false, st);
    nn_file_close(&f);
    return m;
}

nn_model *nn_model_open(const char *path, ts_status *st)
{
    nn_arch arch;
    nn_model *m = NULL;
    nn_file *f = nn_file_open(path, st);
    if (f && !nn_arch_from_file(f, &arch, st)) m = fill(nn_model_plan(&arch, st), f, true, st);
    if (m) m->file = f;
    else nn_file_close(&f);
    return m;
}

nn_model *nn_coder_load(const char *path, ts_status *st)
{
    nn_coder coder;
    nn_model *m = NULL;
    nn_file *f = nn_file_open(path, st);
    if (f && !nn_coder_from_file(f, &coder, st)) m = fill(nn_coder_plan(&coder, st), f, false, st);
    nn_file_close(&f);
    return m;
}

ts_code nn_safetensors_write(const char *path, const nn_block *blocks, int count, const nn_meta *meta, int metas,
                             ts_status *st)
{
    nn_tensor *tensor = malloc(((size_t)count + 1) * sizeof *tensor);
    if (!tensor) return ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    for (int i = 0; i < count; i++) {
        tensor[i] = (nn_tensor){
            .name = blocks[i].name, .rank = blocks[i].rank, .data = (const unsigned char *)blocks[i].data};
        for (int j = 0; j < blocks[i].rank; j++) tensor[i].dim[j] = blocks[i].dim[j];
        nn_tensor_shape(&tensor[i]);
    }
    ts_code code = nn_file_write(path, NN_FORM_SAFETENSORS, tensor, count, NN_DTYPES, meta, metas, NULL, st);
    free(tensor);
    return code;
}

ts_code nn_model_save(const nn_model *model, const float *values, const char *path, const nn_meta *extra, int extras,
                      ts_status *st)
{
    char text[NN_ARCH_TEXT];
    nn_block *block = malloc((size_t)model->params * sizeof *block);
    nn_meta *meta = malloc((NN_ARCH_META + (size_t)extras) * sizeof *meta);
    ts_code code = TS_OK;
    if (!block || !meta) code = ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    for (int i = 0; !code && i < model->params; i++) {
        const nn_param *p = &model->param[i];
        block[i] = (nn_block){.name = p->name, .rank = p->rank, .data = values + p->offset};
        nn_param_dims(p, block[i].dim);
        if (!nn_all_finite(values + p->offset, p->count))
            code = ts_fail(st, TS_NUMERIC, "%s: not written: parameter \"%s\" holds a value that is not finite", path,
                           p->name);
    }
    if (!code) {
        int metas = model->coder.code > 0 ? nn_coder_to_meta(&model->coder, meta, NN_ARCH_META, text, sizeof text)
                                          : nn_arch_to_meta(&model->arch, meta, NN_ARCH_META, text, sizeof text);
        for (int i = 0; i < extras; i++) meta[metas++] = extra[i];
        code = nn_safetensors_write(path, block, model->params, meta, metas, st);
    }
    free(block);
    free(meta);
    return code;
}
