/* The safetensors container (github.com/huggingface/safetensors, README, "Format"): u64 header size, JSON header,
 * values, little endian. */
#include "nn/weights/file_internal.h"
#include "nn/weights/json.h"
#include "nn/weights/text.h"
#include "nn/weights/weights.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* false: s is not UTF-8. */
static bool put_string(nn_text *t, const char *s)
{
    int64_t n = json_escape(s, NULL);
    if (n < 0) return false;
    nn_text_put(t, "\"");
    char *to = nn_text_extend(t, (size_t)n);
    if (to) json_escape(s, to);
    nn_text_put(t, "\"");
    return true;
}

/* order: the tensors as their values follow each other in the file. */
static ts_code make_header(nn_text *t, const char *path, const nn_tensor *tensor, const int *order, int tensors,
                           nn_dtype real, const nn_meta *meta, int metas, ts_status *st)
{
    int64_t at = 0;
    char number[64];
    nn_text_number(t, 0, 8); /* the header's size, at the end */
    nn_text_put(t, "{");
    if (metas > 0) nn_text_put(t, "\"__metadata__\":{");
    for (int i = 0; i < metas; i++) {
        if (i) nn_text_put(t, ",");
        bool good = put_string(t, meta[i].key);
        nn_text_put(t, ":");
        if (!good || !put_string(t, meta[i].value))
            return ts_fail(st, TS_INVALID, "%s: metadata \"%.80s\" is not UTF-8", path, meta[i].key);
    }
    if (metas > 0) nn_text_put(t, tensors ? "}," : "}");
    for (int i = 0; i < tensors; i++) {
        const nn_tensor *e = &tensor[order[i]];
        const nn_dtype to = nn_dtype_out(e->dtype, real);
        if (i) nn_text_put(t, ",");
        if (!put_string(t, e->name))
            return ts_fail(st, TS_INVALID, "%s: the tensor name \"%.80s\" is not UTF-8", path, e->name);
        nn_text_put(t, ":{\"dtype\":\"");
        nn_text_put(t, nn_dtype_name(to));
        nn_text_put(t, "\",\"shape\":[");
        for (int j = 0; j < e->rank; j++) {
            snprintf(number, sizeof number, "%s%lld", j ? "," : "", (long long)e->dim[j]);
            nn_text_put(t, number);
        }
        int64_t end = at + nn_dtype_size(to) * e->count;
        snprintf(number, sizeof number, "],\"data_offsets\":[%lld,%lld]}", (long long)at, (long long)end);
        nn_text_put(t, number);
        at = end;
    }
    nn_text_put(t, "}");
    while (!t->failed && t->used % 64) nn_text_put(t, " "); /* the values begin at a cache line of the mapped file */
    if (t->failed) return ts_fail(st, TS_NOMEM, "%s: no memory for the header", path);
    uint64_t size = t->used - 8;
    memcpy(t->data, &size, 8);
    return TS_OK;
}

ts_code nn_safetensors_put(ts_new_file *o, const nn_tensor *tensor, int tensors, nn_dtype real, const nn_meta *meta,
                           int metas, bool (*stop)(void), ts_status *st)
{
    nn_text t = {0};
    int *order = malloc(((size_t)tensors + 1) * sizeof *order), n = 0;
    void *work = NULL;
    size_t work_size = 0;
    ts_code code = TS_OK;
    if (!order) code = ts_fail(st, TS_NOMEM, "%s: no memory to write it", o->name);
    for (int size = 8; !code && size; size /= 2) /* the widest first, so that every number is aligned to its size */
        for (int i = 0; i < tensors; i++)
            if (nn_dtype_size(nn_dtype_out(tensor[i].dtype, real)) == size) order[n++] = i;
    if (!code) code = make_header(&t, o->name, tensor, order, tensors, real, meta, metas, st);
    if (!code) ts_new_file_put(o, t.data, t.used);
    for (int i = 0; i < tensors && !code && !o->error; i++) {
        if (stop && stop()) {
            code = ts_fail(st, TS_INTERRUPTED, "%s: interrupted: it was not written", o->name);
            break;
        }
        const nn_tensor *e = &tensor[order[i]];
        const nn_dtype to = nn_dtype_out(e->dtype, real);
        const void *bytes = nn_tensor_bytes(e, to, o->name, &work, &work_size, st);
        if (!bytes) code = st ? st->code : TS_FORMAT;
        else ts_new_file_put(o, bytes, (size_t)e->count * (size_t)nn_dtype_size(to));
    }
    free(work);
    free(order);
    free(t.data);
    return code;
}
