/* Reads and checks a safetensors file: afterwards every tensor's bytes are inside the file. */
#include "nn/weights/file_internal.h"
#include "nn/weights/json.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_HEADER = 16 << 20 };

/* A tensor of the header beside its entry, and the end of its values. */
typedef struct place {
    int64_t begin, end;
    bool type;
} place;

typedef struct header {
    nn_file *f;
    json_reader *r;
    place *place; /* of each tensor */
    int places;
} header;

static bool read_metadata(header *h)
{
    json_reader *r = h->r;
    if (h->f->meta) return json_fail(r, "a second __metadata__");
    if (!json_take(r, '{')) return false;
    if (!nn_file_add_meta(h->f)) return json_fail(r, "no memory for the metadata");
    h->f->metas = 0; /* the array exists: the mark of a first __metadata__, even of an empty one */
    if (json_try(r, '}')) return true;
    do {
        nn_meta *m = nn_file_add_meta(h->f);
        if (!m) return json_fail(r, "no memory for the metadata");
        if (!(m->key = json_string(r)) || !json_take(r, ':') || !(m->value = json_string(r))) return false;
    } while (json_try(r, ','));
    return json_take(r, '}');
}

static bool read_type(json_reader *r, nn_tensor *e, place *p)
{
    const char *name = json_string(r);
    for (int i = 0; name && i < NN_DTYPES; i++)
        if (!strcmp(name, nn_dtype_name((nn_dtype)i))) {
            e->dtype = (nn_dtype)i;
            p->type = true;
        }
    if (name && !p->type) {
        char problem[160];
        snprintf(problem, sizeof problem, "tensor \"%.64s\" has the unknown dtype \"%.24s\"", e->name, name);
        return json_fail(r, problem);
    }
    return name != NULL;
}

static bool read_shape(json_reader *r, nn_tensor *e)
{
    if (!json_take(r, '[')) return false;
    if (json_try(r, ']')) return true;
    do {
        if (e->rank == NN_RANK_MAX) return json_fail(r, "a tensor with more than 8 dimensions");
        if (!json_integer(r, &e->dim[e->rank++])) return false;
    } while (json_try(r, ','));
    return json_take(r, ']');
}

static bool read_tensor(json_reader *r, nn_tensor *e, place *p)
{
    bool shape = false, offsets = false;
    if (!json_take(r, '{')) return false;
    do {
        const char *key = json_string(r);
        if (!key || !json_take(r, ':')) return false;
        if (!strcmp(key, "dtype") && !p->type) {
            if (!read_type(r, e, p)) return false;
        } else if (!strcmp(key, "shape") && !shape) {
            shape = read_shape(r, e);
            if (!shape) return false;
        } else if (!strcmp(key, "data_offsets") && !offsets) {
            offsets = json_take(r, '[') && json_integer(r, &p->begin) && json_take(r, ',') &&
                json_integer(r, &p->end) && json_take(r, ']');
            if (!offsets) return false;
        } else {
            char problem[160];
            snprintf(problem, sizeof problem, "tensor \"%.64s\" has the unknown or repeated key \"%.24s\"", e->name,
                     key);
            return json_fail(r, problem);
        }
    } while (json_try(r, ','));
    if (!json_take(r, '}')) return false;
    if (!p->type || !shape || !offsets) {
        char problem[160];
        snprintf(problem, sizeof problem, "tensor \"%.64s\" lacks dtype, shape or data_offsets", e->name);
        return json_fail(r, problem);
    }
    return true;
}

static bool read_header(header *h)
{
    json_reader *r = h->r;
    if (!json_take(r, '{')) return false;
    if (json_try(r, '}')) return json_end(r);
    do {
        const char *name = json_string(r);
        if (!name || !json_take(r, ':')) return false;
        if (!strcmp(name, "__metadata__")) {
            if (!read_metadata(h)) return false;
            continue;
        }
        nn_tensor *e = nn_file_add(h->f);
        if (e && h->f->tensors > h->places) {
            int places = h->places ? 2 * h->places : 16;
            place *grown = realloc(h->place, (size_t)places * sizeof *grown);
            if (!grown) e = NULL;
            else {
                h->place = grown;
                h->places = places;
            }
        }
        if (!e) return json_fail(r, "no memory for the list of tensors");
        e->name = name;
        place *p = &h->place[h->f->tensors - 1];
        *p = (place){0};
        if (!read_tensor(r, e, p)) return false;
    } while (json_try(r, ','));
    return json_take(r, '}') && json_end(r);
}

typedef struct extent {
    int64_t begin, end;
    int tensor;
} extent;

static int by_place(const void *a, const void *b)
{
    const extent *x = a, *y = b;
    if (x->begin != y->begin) return x->begin < y->begin ? -1 : 1;
    return (x->end > y->end) - (x->end < y->end);
}

/* Together the tensors are the rest of the file. */
static ts_code check_order(nn_file *f, extent *x, int64_t bytes, ts_status *st)
{
    int64_t at = 0;
    if (f->tensors) qsort(x, (size_t)f->tensors, sizeof *x, by_place);
    for (int i = 0; i < f->tensors; i++) {
        if (x[i].begin != at)
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" %s", f->path, f->tensor[x[i].tensor].name,
                           x[i].begin < at ? "overlaps another one" : "comes after a hole in the file");
        at = x[i].end;
    }
    if (at != bytes)
        return ts_fail(st, TS_FORMAT, "%s: %lld bytes follow the last tensor", f->path, (long long)(bytes - at));
    return TS_OK;
}

/* Every tensor has the bytes that its shape needs. */
static ts_code check_places(nn_file *f, const place *where, const unsigned char *data, int64_t bytes, ts_status *st)
{
    extent *x = malloc(((size_t)f->tensors + 1) * sizeof *x);
    if (!x) return ts_fail(st, TS_NOMEM, "%s: no memory for the list of tensors", f->path);
    ts_code code = TS_OK;
    for (int i = 0; i < f->tensors && !code; i++) {
        nn_tensor *e = &f->tensor[i];
        int64_t size = 0;
        if (!nn_tensor_shape(e) || __builtin_mul_overflow(e->count, nn_dtype_size(e->dtype), &size))
            code = ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" has an impossible shape", f->path, e->name);
        else if (where[i].begin > where[i].end || where[i].end > bytes)
            code = ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" lies outside the file (is it truncated?)", f->path,
                           e->name);
        else if (where[i].end - where[i].begin != size)
            code = ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" has %lld bytes, its shape needs %lld", f->path,
                           e->name, (long long)(where[i].end - where[i].begin), (long long)size);
        else {
            e->data = data + where[i].begin;
            x[i] = (extent){where[i].begin, where[i].end, i};
        }
    }
    if (!code) code = check_order(f, x, bytes, st);
    free(x);
    return code;
}

ts_code nn_safetensors_parse(nn_file *f, ts_status *st)
{
    uint64_t size;
    if (f->size < 8) return ts_fail(st, TS_FORMAT, "%s: %zu bytes are no safetensors file", f->path, f->size);
    memcpy(&size, f->map, 8);
    if (size > MAX_HEADER)
        return ts_fail(st, TS_FORMAT,
                       "%s: no safetensors file, or one with a header of %llu bytes: at most 16 MiB are read", f->path,
                       (unsigned long long)size);
    if (size > f->size - 8)
        return ts_fail(st, TS_FORMAT, "%s: truncated: the header has %llu bytes, the file %zu", f->path,
                       (unsigned long long)size, f->size);
    f->form = NN_FORM_SAFETENSORS;
    char *strings = ts_arena_alloc(f->arena, size + 1);
    if (!strings) return ts_fail(st, TS_NOMEM, "%s: no memory for the header", f->path);
    json_reader r = {(const char *)f->map + 8, size, 0, strings, 0, f->path, st, false};
    header h = {f, &r, NULL, 0};
    ts_code code = read_header(&h) ? TS_OK : TS_FORMAT;
    if (!code) code = check_places(f, h.place, f->map + 8 + size, (int64_t)(f->size - 8 - size), st);
    free(h.place);
    return code;
}
