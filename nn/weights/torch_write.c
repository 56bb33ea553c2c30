/* What torch.save(state_dict, FILE) writes: a ZIP archive of stored entries, their data at multiples of 64 bytes,
 * data.pkl in protocol 2. */
#include "nn/weights/json.h"
#include "nn/weights/text.h"
#include "nn/weights/torch.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static const char *const storage_of[NN_DTYPES] = {
    [NN_F32] = "Float", [NN_F16] = "Half",  [NN_BF16] = "BFloat16",   [NN_F64] = "Double",
    [NN_I64] = "Long",  [NN_I32] = "Int",   [NN_I16] = "Short",       [NN_I8] = "Char",
    [NN_U8] = "Byte",   [NN_BOOL] = "Bool", [NN_C64] = "ComplexFloat"};

static bool pickle_text(nn_text *t, const char *s)
{
    nn_text_put(t, "X");
    nn_text_number(t, strlen(s), 4);
    nn_text_put(t, s);
    return json_escape(s, NULL) >= 0; /* UTF-8 */
}

static void pickle_int(nn_text *t, int64_t v)
{
    if (v >= 0 && v <= INT32_MAX) {
        nn_text_put(t, "J");
        nn_text_number(t, (uint64_t)v, 4);
    } else {
        nn_text_put(t, "\x8a\x08");
        nn_text_number(t, (uint64_t)v, 8);
    }
}

static void pickle_ints(nn_text *t, const int64_t *v, int n)
{
    nn_text_put(t, "(");
    for (int i = 0; i < n; i++) pickle_int(t, v[i]);
    nn_text_put(t, "t");
}

#define ORDERED_DICT "ccollections\nOrderedDict\n)R"

static ts_code pickle_tensor(nn_text *t, const char *path, const nn_tensor *e, nn_dtype to, int key, ts_status *st)
{
    char text[80];
    nn_tensor row_major = *e;
    if (!storage_of[to])
        return ts_fail(st, TS_UNSUPPORTED, "%s: tensor \"%.200s\" has dtype %s, which has no storage in PyTorch", path,
                       e->name, nn_dtype_name(to));
    if (!pickle_text(t, e->name))
        return ts_fail(st, TS_INVALID, "%s: the tensor name \"%.80s\" is not UTF-8", path, e->name);
    nn_tensor_shape(&row_major);
    nn_text_put(t, "ctorch._utils\n_rebuild_tensor_v2\n((");
    pickle_text(t, "storage");
    snprintf(text, sizeof text, "ctorch\n%sStorage\n", storage_of[to]);
    nn_text_put(t, text);
    snprintf(text, sizeof text, "%d", key);
    pickle_text(t, text);
    pickle_text(t, "cpu");
    pickle_int(t, e->count);
    nn_text_put(t, "tQ");
    pickle_int(t, 0); /* offset */
    pickle_ints(t, e->dim, e->rank);
    pickle_ints(t, row_major.stride, e->rank);
    nn_text_put(t, "\x89" ORDERED_DICT "tR"); /* requires_grad: False; no hooks */
    return TS_OK;
}

/* OrderedDict of the tensors; metadata becomes its attribute "lgd", a dict of texts. */
static ts_code pickle_all(nn_text *t, const char *path, const nn_tensor *tensor, int tensors, nn_dtype real,
                          const nn_meta *meta, int metas, ts_status *st)
{
    nn_text_put(t, "\x80\x02" ORDERED_DICT "(");
    for (int i = 0; i < tensors; i++) {
        ts_code code = pickle_tensor(t, path, &tensor[i], nn_dtype_out(tensor[i].dtype, real), i, st);
        if (code) return code;
    }
    nn_text_put(t, "u");
    if (metas > 0) {
        nn_text_put(t, "}(");
        pickle_text(t, "lgd");
        nn_text_put(t, "}(");
        for (int i = 0; i < metas; i++)
            if (!pickle_text(t, meta[i].key) || !pickle_text(t, meta[i].value))
                return ts_fail(st, TS_INVALID, "%s: metadata \"%.80s\" is not UTF-8", path, meta[i].key);
        nn_text_put(t, "uub");
    }
    nn_text_put(t, ".");
    return t->failed ? ts_fail(st, TS_NOMEM, "%s: no memory for its list of tensors", path) : TS_OK;
}

/* The archive's directory grows beside it. Sizes and offsets are always in the 64-bit fields: one form for small and
 * for large files. */
typedef struct archive {
    ts_new_file *o;
    nn_text directory;
    int entries;
} archive;

/* What a local header and a directory entry have in common: from the version to the lengths of name and extra. */
static void common(nn_text *t, uint32_t crc, size_t name, size_t extra)
{
    nn_text_number(t, 45, 2);       /* version needed: 64-bit fields */
    nn_text_number(t, 0, 2);        /* flags */
    nn_text_number(t, 0, 2);        /* stored */
    nn_text_number(t, 0x210000, 4); /* 1980-01-01, 0:00: the same bytes every time */
    nn_text_number(t, crc, 4);
    nn_text_number(t, UINT64_MAX, 8); /* both sizes are in the extra field */
    nn_text_number(t, name, 2);
    nn_text_number(t, extra, 2);
}

static void put_entry(archive *a, const char *name, const void *data, size_t size)
{
    enum { ALIGN = 64, LOCAL = 30, WIDE = 20 };
    const uint32_t crc = (uint32_t)crc32_z(0, data, size);
    const uint64_t at = (uint64_t)a->o->written, length = strlen(name);
    const uint64_t padding = (ALIGN - (at + LOCAL + length + WIDE + 4) % ALIGN) % ALIGN;
    nn_text local = {0};
    nn_text_put(&local, "PK\3\4");
    common(&local, crc, length, WIDE + 4 + padding);
    nn_text_put(&local, name);
    nn_text_number(&local, 1, 2);
    nn_text_number(&local, 16, 2);
    nn_text_number(&local, size, 8);
    nn_text_number(&local, size, 8);
    nn_text_put(&local, "FB"); /* PyTorch's name for its padding */
    nn_text_number(&local, padding, 2);
    for (uint64_t i = 0; i < padding; i++) nn_text_put(&local, "Z");
    a->directory.failed |= local.failed;
    if (!local.failed) ts_new_file_put(a->o, local.data, local.used);
    free(local.data);
    ts_new_file_put(a->o, data, size);

    nn_text *d = &a->directory;
    nn_text_put(d, "PK\1\2");
    nn_text_number(d, 45, 2); /* version made by */
    common(d, crc, length, 28);
    nn_text_number(d, 0, 4); /* comment, disk */
    nn_text_number(d, 0, 6); /* attributes */
    nn_text_number(d, UINT32_MAX, 4);
    nn_text_put(d, name);
    nn_text_number(d, 1, 2);
    nn_text_number(d, 24, 2);
    nn_text_number(d, size, 8);
    nn_text_number(d, size, 8);
    nn_text_number(d, at, 8);
    a->entries++;
}

static void put_directory(archive *a)
{
    nn_text *d = &a->directory;
    const uint64_t at = (uint64_t)a->o->written, size = d->used;
    nn_text_put(d, "PK\6\6");
    nn_text_number(d, 44, 8); /* bytes that follow */
    nn_text_number(d, 45 | 45 << 16, 4);
    nn_text_number(d, 0, 8); /* disks */
    nn_text_number(d, (uint64_t)a->entries, 8);
    nn_text_number(d, (uint64_t)a->entries, 8);
    nn_text_number(d, size, 8);
    nn_text_number(d, at, 8);
    nn_text_put(d, "PK\6\7");
    nn_text_number(d, 0, 4);
    nn_text_number(d, at + size, 8);
    nn_text_number(d, 1, 4);
    nn_text_put(d, "PK\5\6");
    nn_text_number(d, 0, 4);
    nn_text_number(d, UINT32_MAX, 4); /* both counts */
    nn_text_number(d, UINT64_MAX, 8); /* size and place */
    nn_text_number(d, 0, 2);
    if (!d->failed) ts_new_file_put(a->o, d->data, d->used);
}

ts_code nn_torch_put(ts_new_file *o, const nn_tensor *tensor, int tensors, nn_dtype real, const nn_meta *meta,
                     int metas, bool (*stop)(void), ts_status *st)
{
    archive a = {.o = o};
    nn_text list = {0};
    void *work = NULL;
    size_t work_size = 0;
    ts_code code = pickle_all(&list, o->name, tensor, tensors, real, meta, metas, st);
    if (!code && list.used > PK_MOST_BYTES)
        code = ts_fail(st, TS_UNSUPPORTED, "%s: not written: %d tensors are more than are read back", o->name, tensors);
    if (!code) {
        put_entry(&a, "archive/data.pkl", list.data, list.used);
        put_entry(&a, "archive/byteorder", "little", 6);
    }
    for (int i = 0; i < tensors && !code && !o->error; i++) {
        if (stop && stop()) {
            code = ts_fail(st, TS_INTERRUPTED, "%s: interrupted: it was not written", o->name);
            break;
        }
        char name[40];
        const nn_dtype to = nn_dtype_out(tensor[i].dtype, real);
        const void *bytes = nn_tensor_bytes(&tensor[i], to, o->name, &work, &work_size, st);
        snprintf(name, sizeof name, "archive/data/%d", i);
        if (!bytes) code = st ? st->code : TS_FORMAT;
        else put_entry(&a, name, bytes, (size_t)tensor[i].count * (size_t)nn_dtype_size(to));
    }
    if (!code) {
        put_entry(&a, "archive/version", "3\n", 2);
        put_directory(&a);
    }
    if (!code && a.directory.failed) code = ts_fail(st, TS_NOMEM, "%s: no memory for its directory", o->name);
    free(work);
    free(list.data);
    free(a.directory.data);
    return code;
}
