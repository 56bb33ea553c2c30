/* PyTorch's files: a ZIP archive of data.pkl and one entry a storage, or (before version 1.6) pickles and raw storages
 * one after the other. */
#include "nn/weights/json.h"
#include "nn/weights/torch.h"
#include "nn/weights/zip.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_DEPTH = 32, MOST_NAMES = 16 << 20, MOST_NAME = 1024, MOST_EXPANDED = 1 << 24 };

/* A storage of an old file. */
typedef struct old_storage {
    const char *key;
    size_t length;
    uint64_t begin; /* in the file, behind its count */
    int64_t numel;
} old_storage;

typedef struct reader {
    nn_file *f;
    ts_status *st;
    zip_archive zip;
    char prefix[256]; /* of the archive's entries: its folder and "data/" */
    bool swapped;
    old_storage *old; /* by key */
    int olds;
    char name[MOST_NAME];       /* of what is being visited */
    size_t visits, most_visits; /* of items: in a tree there are fewer than bytes in its pickle */
    size_t names;
} reader;

static int by_key(const void *a, const void *b)
{
    const old_storage *x = a, *y = b;
    if (x->length != y->length) return x->length < y->length ? -1 : 1;
    return memcmp(x->key, y->key, x->length);
}

/* Where the storage's first number lies, all of its numbers being in the file. */
static const unsigned char *storage_data(reader *r, const torch_storage *s, int size)
{
    char shown[80];
    int64_t bytes;
    pk_printable(s->key, s->length, shown, sizeof shown);
    bool possible = !__builtin_mul_overflow(s->numel, size, &bytes);
    if (r->old) {
        const old_storage wanted = {.key = s->key, .length = s->length},
                          *o = bsearch(&wanted, r->old, (size_t)r->olds, sizeof *r->old, by_key);
        if (!o) ts_fail(r->st, TS_FORMAT, "%s: storage %s is missing", r->f->path, shown);
        else if (!possible || s->numel > o->numel || (uint64_t)bytes > r->f->size - o->begin)
            ts_fail(r->st, TS_FORMAT, "%s: storage %s has fewer numbers than it says (is the file truncated?)",
                    r->f->path, shown);
        else return r->f->map + o->begin;
        return NULL;
    }
    char entry[512];
    zip_entry *e = NULL;
    const size_t n = strlen(r->prefix);
    if (n + s->length <= sizeof entry) {
        memcpy(entry, r->prefix, n);
        memcpy(entry + n, s->key, s->length);
        e = zip_find(&r->zip, entry, n + s->length);
    }
    if (!e) ts_fail(r->st, TS_FORMAT, "%s: storage %s is missing", r->f->path, shown);
    else if (!possible || (uint64_t)bytes > e->size)
        ts_fail(r->st, TS_FORMAT, "%s: storage %s has %llu bytes, its %lld numbers need more", r->f->path, shown,
                (unsigned long long)e->size, (long long)s->numel);
    else return zip_data(r->f, e, r->st);
    return NULL;
}

static ts_code add_tensor(reader *r, const torch_tensor *t)
{
    const torch_storage *s = t->storage;
    nn_tensor *e = nn_file_add(r->f);
    const size_t length = strlen(r->name);
    char *name = ts_arena_alloc(r->f->arena, length + 1);
    r->names += length + 1;
    if (r->names > MOST_NAMES)
        return ts_fail(r->st, TS_FORMAT, "%s: the names of its tensors are longer than %d MB together", r->f->path,
                       MOST_NAMES >> 20);
    if (!e || !name) return ts_fail(r->st, TS_NOMEM, "%s: no memory for the list of tensors", r->f->path);
    memcpy(name, r->name, length + 1);
    *e = (nn_tensor){.name = name, .dtype = t->dtype, .swapped = r->swapped, .rank = t->rank};
    memcpy(e->dim, t->dim, sizeof e->dim);
    if (!nn_tensor_shape(e))
        return ts_fail(r->st, TS_FORMAT, "%s: tensor \"%.200s\" has an impossible shape", r->f->path, name);
    memcpy(e->stride, t->stride, sizeof e->stride);
    const int size = nn_dtype_size(t->dtype), unit = nn_dtype_size(s->dtype);
    /* In numbers of the tensor's type; an untyped storage counts bytes. */
    int64_t last = t->offset, has = s->view_size;
    bool inside = s->dtype == t->dtype || !__builtin_mul_overflow(s->view_size / size, unit, &has);
    inside = inside && t->offset <= has;
    for (int i = 0; i < t->rank && e->count; i++) {
        int64_t reach;
        inside = inside && !__builtin_mul_overflow(t->dim[i] - 1, t->stride[i], &reach) &&
            !__builtin_add_overflow(last, reach, &last);
    }
    if (!inside || (e->count && last >= has))
        return ts_fail(r->st, TS_FORMAT, "%s: tensor \"%.200s\" reaches beyond its storage of %lld numbers", r->f->path,
                       name, (long long)has);
    if (e->count > has && e->count > MOST_EXPANDED)
        return ts_fail(r->st, TS_UNSUPPORTED,
                       "%s: tensor \"%.200s\" repeats %lld numbers to %lld: at most 16 million are expanded",
                       r->f->path, name, (long long)has, (long long)e->count);
    const unsigned char *data = storage_data(r, s, unit);
    if (!data) return r->st ? r->st->code : TS_FORMAT;
    e->data = data + s->view_offset * unit + (e->count ? t->offset * size : 0);
    return TS_OK;
}

/* Appends a key to the name; false: no UTF-8, or too long. */
static bool name_key(reader *r, const pk_value *key)
{
    char text[MOST_NAME];
    size_t at = strlen(r->name);
    if (key->kind == PK_TEXT) {
        if (key->length >= sizeof text || memchr(key->text, 0, key->length)) return false;
        memcpy(text, key->text, key->length);
        text[key->length] = 0;
        if (json_escape(text, NULL) < 0) return false;
    } else snprintf(text, sizeof text, "%lld", (long long)key->number);
    return snprintf(r->name + at, sizeof r->name - at, "%s%s", at ? "." : "", text) < (int)(sizeof r->name - at);
}

/* A level that only says that a state dict follows has no part in the names. */
static bool is_wrapper(const pk_value *key)
{
    return pk_is_text(key, "state_dict") || pk_is_text(key, "model_state_dict");
}

static ts_code visit(reader *r, const pk_value *v, int depth)
{
    if (v->kind == PK_OBJECT && v->tag == TORCH_TENSOR) {
        if (!*r->name) strcpy(r->name, "tensor"); /* the file is one tensor */
        return add_tensor(r, v->object);
    }
    if (v->kind != PK_DICT && v->kind != PK_LIST && v->kind != PK_TUPLE) return TS_OK;
    if (depth == MOST_DEPTH)
        return ts_fail(r->st, TS_FORMAT, "%s: dictionaries are nested more than %d deep", r->f->path, MOST_DEPTH);
    const size_t at = strlen(r->name);
    const uint32_t each = v->kind == PK_DICT ? 2 : 1;
    for (uint32_t i = 0; i < v->length; i += each) {
        const pk_value place = {.kind = PK_INT, .number = i}, *key = each == 2 ? v->item[i] : &place;
        if (++r->visits > r->most_visits)
            return ts_fail(r->st, TS_FORMAT, "%s: dictionaries within dictionaries that are all the same ones",
                           r->f->path);
        if (key->kind != PK_TEXT && key->kind != PK_INT && key->kind != PK_BOOL)
            return ts_fail(r->st, TS_FORMAT, "%s: a key that is neither text nor a whole number", r->f->path);
        if (!(at == 0 && is_wrapper(key) && v->item[i + each - 1]->kind == PK_DICT) && !name_key(r, key))
            return ts_fail(r->st, TS_FORMAT, "%s: a name that is not UTF-8 or longer than %d bytes", r->f->path,
                           MOST_NAME);
        ts_code code = visit(r, v->item[i + each - 1], depth + 1);
        r->name[at] = 0;
        if (code) return code;
    }
    return TS_OK;
}

static char *copy_text(reader *r, const pk_value *v)
{
    char *text = v->kind == PK_TEXT ? ts_arena_alloc(r->f->arena, v->length + 1u) : NULL;
    if (!text) return NULL;
    memcpy(text, v->text, v->length);
    text[v->length] = 0;
    return text;
}

/* lgd-convert keeps metadata as the state dict's attribute "lgd". */
static ts_code take_metadata(reader *r, const pk_value *root)
{
    const pk_value *all = NULL;
    for (uint32_t i = 0; root->kind == PK_DICT && root->state && i < root->state->length; i += 2)
        if (pk_is_text(root->state->item[i], "lgd")) all = root->state->item[i + 1];
    for (uint32_t i = 0; all && all->kind == PK_DICT && i < all->length; i += 2) {
        nn_meta *m = nn_file_add_meta(r->f);
        if (!m || !(m->key = copy_text(r, all->item[i])) || !(m->value = copy_text(r, all->item[i + 1])))
            return ts_fail(r->st, TS_FORMAT, "%s: metadata that is no text", r->f->path);
    }
    return TS_OK;
}

static ts_code take_tensors(reader *r, const pk_value *root)
{
    ts_code code = visit(r, root, 0);
    if (!code) code = take_metadata(r, root);
    if (!code && r->f->tensors == 0) code = ts_fail(r->st, TS_FORMAT, "%s: no tensor is in it", r->f->path);
    return code;
}

static bool ends_with(const zip_entry *e, const char *end)
{
    size_t n = strlen(end);
    return e->length >= n && memcmp(e->name + e->length - n, end, n) == 0;
}

static ts_code read_zip(reader *r)
{
    nn_file *f = r->f;
    ts_code code = zip_open(f, &r->zip, r->st);
    if (code) return code;
    zip_entry *main_entry = NULL;
    for (int i = 0; i < r->zip.entries; i++) {
        zip_entry *e = &r->zip.entry[i];
        if (!ends_with(e, "/data.pkl") || memchr(e->name, '/', e->length - 9)) continue;
        if (main_entry) return ts_fail(r->st, TS_FORMAT, "%s: two folders with a data.pkl", f->path);
        main_entry = e;
    }
    if (!main_entry || main_entry->length - 9 > sizeof r->prefix - 16)
        return ts_fail(r->st, TS_FORMAT, "%s: a ZIP archive without FOLDER/data.pkl: not written by torch.save",
                       f->path);
    const int folder = (int)main_entry->length - 9;
    snprintf(r->prefix, sizeof r->prefix, "%.*s/byteorder", folder, main_entry->name);
    zip_entry *order = zip_find(&r->zip, r->prefix, strlen(r->prefix));
    if (order) {
        const unsigned char *text = order->size <= 6 ? zip_data(f, order, r->st) : NULL;
        if (text && order->size == 3 && !memcmp(text, "big", 3)) r->swapped = true;
        else if (!text || order->size != 6 || memcmp(text, "little", 6) != 0)
            return ts_fail(r->st, TS_FORMAT, "%s: byteorder is neither little nor big", f->path);
    }
    snprintf(r->prefix, sizeof r->prefix, "%.*s/data/", folder, main_entry->name);
    if (main_entry->size > PK_MOST_BYTES)
        return ts_fail(r->st, TS_FORMAT, "%s: data.pkl has more than 4 MiB: at most that is read", f->path);
    const unsigned char *data = zip_data(f, main_entry, r->st);
    if (!data) return r->st ? r->st->code : TS_FORMAT;
    pickle p = {.data = data,
                .size = main_entry->size,
                .path = f->path,
                .part = "data.pkl",
                .hooks = &torch_hooks,
                .arena = f->arena,
                .st = r->st};
    const pk_value *root = pk_read(&p);
    r->most_visits = 2 * p.size + 1000;
    return root ? take_tensors(r, root) : r->st ? r->st->code : TS_FORMAT;
}

/* 0x1950a86a20f9469cfc6c as pickled: the first thing in an old file. */
static const unsigned char old_magic[] = {0x8a, 0x0a, 0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19, '.'};

/* What follows the pickles: for each key in turn a count and the numbers, always little endian. The types stand in the
 * pickle of the tensors; here only counts are, so that the size of a number is asked of the tensors' storages. */
typedef struct sizes {
    const torch_storage **storage;
    int count, capacity;
} sizes;

static bool collect(reader *r, sizes *s, const pk_value *v, int depth)
{
    if (v->kind == PK_OBJECT && v->tag == TORCH_TENSOR) {
        if (s->count == s->capacity) {
            int capacity = s->capacity ? 2 * s->capacity : 64;
            const torch_storage **grown = realloc(s->storage, (size_t)capacity * sizeof *grown);
            if (!grown) return false;
            s->storage = grown;
            s->capacity = capacity;
        }
        s->storage[s->count++] = ((const torch_tensor *)v->object)->storage;
    }
    if (depth == MOST_DEPTH || (v->kind != PK_DICT && v->kind != PK_LIST && v->kind != PK_TUPLE)) return true;
    for (uint32_t i = 0; i < v->length; i++)
        if (++r->visits > r->most_visits || !collect(r, s, v->item[i], depth + 1)) return false;
    return true;
}

static int by_storage_key(const void *a, const void *b)
{
    const torch_storage *x = *(const torch_storage *const *)a, *y = *(const torch_storage *const *)b;
    if (x->length != y->length) return x->length < y->length ? -1 : 1;
    return memcmp(x->key, y->key, x->length);
}

static ts_code place_storages(reader *r, const pk_value *keys, const sizes *s, uint64_t at)
{
    nn_file *f = r->f;
    r->old = malloc(((size_t)keys->length + 1) * sizeof *r->old);
    if (!r->old) return ts_fail(r->st, TS_NOMEM, "%s: no memory for the list of storages", f->path);
    for (uint32_t i = 0; i < keys->length; i++) {
        const pk_value *key = keys->item[i];
        if (key->kind != PK_TEXT) return ts_fail(r->st, TS_FORMAT, "%s: a storage whose key is no text", f->path);
        const torch_storage wanted = {.key = key->text, .length = key->length}, *w = &wanted, **found = NULL;
        if (s->count) found = bsearch(&w, s->storage, (size_t)s->count, sizeof *s->storage, by_storage_key);
        if (!found)
            return ts_fail(r->st, TS_FORMAT, "%s: a storage that no tensor uses", f->path); /* its size is not known */
        if (f->size - at < 8)
            return ts_fail(r->st, TS_FORMAT, "%s: truncated before storage %u of %u", f->path, i + 1, keys->length);
        uint64_t numel = 0;
        for (int j = 8; j-- > 0;) numel = numel << 8 | f->map[at + (uint64_t)j];
        at += 8;
        const uint64_t size = (uint64_t)nn_dtype_size((*found)->dtype);
        if (numel > (f->size - at) / size)
            return ts_fail(r->st, TS_FORMAT, "%s: truncated in storage %u of %u", f->path, i + 1, keys->length);
        r->old[r->olds++] = (old_storage){key->text, key->length, at, (int64_t)numel};
        at += numel * size;
    }
    qsort(r->old, (size_t)r->olds, sizeof *r->old, by_key);
    for (int i = 1; i < r->olds; i++)
        if (by_key(&r->old[i - 1], &r->old[i]) == 0)
            return ts_fail(r->st, TS_FORMAT, "%s: a storage is there twice", f->path);
    return TS_OK;
}

static ts_code read_old(reader *r)
{
    static const char *const part[] = {"magic number", "protocol version", "system's description", "tensors",
                                       "storage keys"};
    nn_file *f = r->f;
    pickle p = {
        .data = f->map, .size = f->size, .path = f->path, .hooks = &torch_hooks, .arena = f->arena, .st = r->st};
    const pk_value *v[5];
    for (int i = 0; i < 5; i++) {
        p.part = part[i];
        if (!(v[i] = pk_read(&p))) return r->st ? r->st->code : TS_FORMAT;
    }
    r->most_visits = 2 * p.at + 1000;
    if (v[1]->kind != PK_INT || v[1]->number != 1001)
        return ts_fail(r->st, TS_UNSUPPORTED, "%s: the protocol version is not 1001", f->path);
    if (v[4]->kind != PK_LIST) return ts_fail(r->st, TS_FORMAT, "%s: the storage keys are no list", f->path);
    sizes s = {0};
    ts_code code = collect(r, &s, v[3], 0)
        ? TS_OK
        : ts_fail(r->st, TS_NOMEM, "%s: no memory for the list of storages, or too many items", f->path);
    if (s.count) qsort(s.storage, (size_t)s.count, sizeof *s.storage, by_storage_key);
    for (int i = 1; i < s.count && !code; i++)
        if (by_storage_key(&s.storage[i - 1], &s.storage[i]) == 0 && s.storage[i - 1]->dtype != s.storage[i]->dtype)
            code = ts_fail(r->st, TS_FORMAT, "%s: one storage with two types", f->path);
    if (!code) code = place_storages(r, v[4], &s, p.at);
    free(s.storage);
    r->visits = 0;
    return code ? code : take_tensors(r, v[3]);
}

bool nn_torch_is_zip(const nn_file *f) { return f->size >= 4 && memcmp(f->map, "PK\3\4", 4) == 0; }

bool nn_torch_is_old(const nn_file *f)
{
    return f->size > 64 && f->map[0] == 0x80 && memmem(f->map, 32, old_magic, sizeof old_magic) != NULL;
}

ts_code nn_torch_parse(nn_file *f, ts_status *st)
{
    ts_status own = {0}; /* codes are taken from it */
    reader *r = calloc(1, sizeof *r);
    if (!r) return ts_fail(st, TS_NOMEM, "%s: no memory to read it", f->path);
    r->f = f;
    r->st = st ? st : &own;
    f->form = nn_torch_is_zip(f) ? NN_FORM_TORCH_ZIP : NN_FORM_TORCH_OLD;
    ts_code code = f->form == NN_FORM_TORCH_ZIP ? read_zip(r) : read_old(r);
    zip_free(&r->zip);
    free(r->old);
    free(r);
    return code;
}
