/* Opens and checks a safetensors file. Nothing in it is believed: after nn_safetensors_open every tensor's bytes are inside the file. */
#include "nn/json.h"
#include "nn/weights.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_HEADER = 16 << 20, MAX_RANK = 8 };

typedef struct entry {
    const char *name;
    const struct kind *kind;
    int rank;
    int64_t dim[MAX_RANK], begin, end;
} entry;

struct nn_file {
    char *path, *strings;
    const unsigned char *map, *data; /* the file, and where its values begin */
    size_t size;
    entry *tensor;        /* in the file's order */
    const entry **sorted; /* by name */
    nn_meta *meta;
    int tensors, metas;
};

/* The format's types. Only three of them can be weights, but any may lie in a file beside them. */
static const struct kind {
    const char *name;
    int size;
    bool readable;
} kinds[] = {{"F32", 4, true},  {"F16", 2, true},  {"BF16", 2, true},   {"F64", 8, false},     {"I64", 8, false}, {"U64", 8, false}, {"I32", 4, false},
             {"U32", 4, false}, {"I16", 2, false}, {"U16", 2, false},   {"I8", 1, false},      {"U8", 1, false},  {"BOOL", 1, false}, {"F8_E5M2", 1, false},
             {"F8_E4M3", 1, false}};

/* Room for one more item in an array of count items that grows by doubling from 16. NULL: no memory, the array is as it was. */
static void *grow(void *array, int count, size_t size)
{
    if (count && (count < 16 || count & (count - 1))) return array;
    return realloc(array, (size_t)(count ? 2 * count : 16) * size);
}

static bool read_metadata(nn_file *f, json_reader *r)
{
    if (f->meta) return json_fail(r, "a second __metadata__");
    if (!json_take(r, '{')) return false;
    if (!(f->meta = grow(NULL, 0, sizeof *f->meta))) return json_fail(r, "no memory for the metadata");
    if (json_try(r, '}')) return true;
    do {
        nn_meta *grown = grow(f->meta, f->metas, sizeof *f->meta);
        if (!grown) return json_fail(r, "no memory for the metadata");
        f->meta = grown;
        nn_meta *m = &f->meta[f->metas];
        if (!(m->key = json_string(r)) || !json_take(r, ':') || !(m->value = json_string(r))) return false;
        f->metas++;
    } while (json_try(r, ','));
    return json_take(r, '}');
}

static bool read_kind(json_reader *r, entry *e)
{
    const char *name = json_string(r);
    for (size_t i = 0; name && i < sizeof kinds / sizeof *kinds; i++)
        if (!strcmp(name, kinds[i].name)) e->kind = &kinds[i];
    if (name && !e->kind) {
        char problem[160];
        snprintf(problem, sizeof problem, "tensor \"%.64s\" has the unknown dtype \"%.24s\"", e->name, name);
        return json_fail(r, problem);
    }
    return name != NULL;
}

static bool read_shape(json_reader *r, entry *e)
{
    if (!json_take(r, '[')) return false;
    if (json_try(r, ']')) return true;
    do {
        if (e->rank == MAX_RANK) return json_fail(r, "a tensor with more than 8 dimensions");
        if (!json_integer(r, &e->dim[e->rank++])) return false;
    } while (json_try(r, ','));
    return json_take(r, ']');
}

static bool read_tensor(json_reader *r, entry *e)
{
    bool shape = false, offsets = false;
    if (!json_take(r, '{')) return false;
    do {
        const char *key = json_string(r);
        if (!key || !json_take(r, ':')) return false;
        if (!strcmp(key, "dtype") && !e->kind) {
            if (!read_kind(r, e)) return false;
        } else if (!strcmp(key, "shape") && !shape) {
            shape = read_shape(r, e);
            if (!shape) return false;
        } else if (!strcmp(key, "data_offsets") && !offsets) {
            offsets = json_take(r, '[') && json_integer(r, &e->begin) && json_take(r, ',') && json_integer(r, &e->end) && json_take(r, ']');
            if (!offsets) return false;
        } else {
            char problem[160];
            snprintf(problem, sizeof problem, "tensor \"%.64s\" has the unknown or repeated key \"%.24s\"", e->name, key);
            return json_fail(r, problem);
        }
    } while (json_try(r, ','));
    if (!json_take(r, '}')) return false;
    if (!e->kind || !shape || !offsets) {
        char problem[160];
        snprintf(problem, sizeof problem, "tensor \"%.64s\" lacks dtype, shape or data_offsets", e->name);
        return json_fail(r, problem);
    }
    return true;
}

static bool read_header(nn_file *f, json_reader *r)
{
    if (!json_take(r, '{')) return false;
    if (json_try(r, '}')) return json_end(r);
    do {
        const char *name = json_string(r);
        if (!name || !json_take(r, ':')) return false;
        if (!strcmp(name, "__metadata__")) {
            if (!read_metadata(f, r)) return false;
            continue;
        }
        entry *grown = grow(f->tensor, f->tensors, sizeof *f->tensor);
        if (!grown) return json_fail(r, "no memory for the list of tensors");
        f->tensor = grown;
        f->tensor[f->tensors] = (entry){.name = name};
        if (!read_tensor(r, &f->tensor[f->tensors])) return false;
        f->tensors++;
    } while (json_try(r, ','));
    return json_take(r, '}') && json_end(r);
}

static int by_name(const void *a, const void *b) { return strcmp((*(const entry *const *)a)->name, (*(const entry *const *)b)->name); }

static int by_place(const void *a, const void *b)
{
    const entry *x = *(const entry *const *)a, *y = *(const entry *const *)b;
    if (x->begin != y->begin) return x->begin < y->begin ? -1 : 1;
    return (x->end > y->end) - (x->end < y->end);
}

/* Every tensor has the bytes that its shape needs, and together they are the rest of the file. */
static ts_code check_places(nn_file *f, int64_t bytes, ts_status *st)
{
    const entry **s = f->sorted;
    for (int i = 0; i < f->tensors; i++) {
        const entry *e = &f->tensor[i];
        int64_t size = e->kind->size;
        for (int j = 0; j < e->rank; j++)
            if (__builtin_mul_overflow(size, e->dim[j], &size))
                return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" has an impossible shape", f->path, e->name);
        if (e->begin > e->end || e->end > bytes)
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" lies outside the file (is it truncated?)", f->path, e->name);
        if (e->end - e->begin != size)
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" has %lld bytes, its shape needs %lld", f->path, e->name, (long long)(e->end - e->begin),
                           (long long)size);
        s[i] = e;
    }
    int64_t at = 0;
    if (f->tensors) qsort(s, (size_t)f->tensors, sizeof *s, by_place);
    for (int i = 0; i < f->tensors; i++) {
        if (s[i]->begin != at)
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" %s", f->path, s[i]->name,
                           s[i]->begin < at ? "overlaps another one" : "comes after a hole in the file");
        at = s[i]->end;
    }
    if (at != bytes) return ts_fail(st, TS_FORMAT, "%s: %lld bytes follow the last tensor", f->path, (long long)(bytes - at));
    return TS_OK;
}

static ts_code check_names(nn_file *f, ts_status *st)
{
    if (f->tensors) qsort(f->sorted, (size_t)f->tensors, sizeof *f->sorted, by_name);
    for (int i = 1; i < f->tensors; i++)
        if (!strcmp(f->sorted[i - 1]->name, f->sorted[i]->name))
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" is there twice", f->path, f->sorted[i]->name);
    if (f->metas > 1000) return ts_fail(st, TS_FORMAT, "%s: %d metadata keys (at most 1000)", f->path, f->metas); /* compared in pairs below */
    for (int i = 0; i < f->metas; i++)
        for (int j = 0; j < i; j++)
            if (!strcmp(f->meta[i].key, f->meta[j].key))
                return ts_fail(st, TS_FORMAT, "%s: metadata key \"%.80s\" is there twice", f->path, f->meta[i].key);
    return TS_OK;
}

static ts_code parse(nn_file *f, ts_status *st)
{
    uint64_t header;
    if (f->size < 8) return ts_fail(st, TS_FORMAT, "%s: %zu bytes are no safetensors file", f->path, f->size);
    memcpy(&header, f->map, 8);
    if (header > MAX_HEADER)
        return ts_fail(st, TS_FORMAT, "%s: no safetensors file, or one with a header of %llu bytes: at most 16 MiB are read", f->path,
                       (unsigned long long)header);
    if (header > f->size - 8)
        return ts_fail(st, TS_FORMAT, "%s: truncated: the header has %llu bytes, the file %zu", f->path, (unsigned long long)header, f->size);
    f->data = f->map + 8 + header;
    f->strings = malloc(header + 1);
    if (!f->strings) return ts_fail(st, TS_NOMEM, "%s: no memory for the header", f->path);
    json_reader r = {(const char *)f->map + 8, header, 0, f->strings, 0, f->path, st, false};
    if (!read_header(f, &r)) return TS_FORMAT;
    f->sorted = malloc(((size_t)f->tensors + 1) * sizeof *f->sorted);
    if (!f->sorted) return ts_fail(st, TS_NOMEM, "%s: no memory for the list of tensors", f->path);
    ts_code code = check_places(f, (int64_t)(f->size - 8 - header), st);
    return code ? code : check_names(f, st);
}

static ts_code map_file(nn_file *f, ts_status *st)
{
    struct stat s;
    int fd = open(f->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a pipe is refused below instead of being waited for */
    if (fd < 0 || fstat(fd, &s) != 0) {
        ts_fail(st, TS_IO, "%s: cannot open it: %s", f->path, strerror(errno));
    } else if (!S_ISREG(s.st_mode)) {
        ts_fail(st, TS_IO, "%s: not a regular file", f->path);
    } else if (s.st_size == 0) {
        ts_fail(st, TS_FORMAT, "%s: the file is empty", f->path);
    } else {
        void *map = mmap(NULL, (size_t)s.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
        if (map == MAP_FAILED) ts_fail(st, TS_IO, "%s: cannot map it: %s", f->path, strerror(errno));
        else {
            f->map = map;
            f->size = (size_t)s.st_size;
        }
    }
    if (fd >= 0) close(fd);
    return f->map ? TS_OK : TS_IO;
}

nn_file *nn_safetensors_open(const char *path, ts_status *st)
{
    nn_file *f = calloc(1, sizeof *f);
    if (f) f->path = strdup(path);
    if (!f || !f->path) ts_fail(st, TS_NOMEM, "%s: no memory to open it", path);
    else if (!map_file(f, st) && !parse(f, st)) return f;
    nn_safetensors_close(&f);
    return NULL;
}

void nn_safetensors_close(nn_file **file)
{
    nn_file *f = *file;
    if (!f) return;
    if (f->map) munmap((void *)(uintptr_t)f->map, f->size);
    free(f->tensor);
    free(f->sorted);
    free(f->meta);
    free(f->strings);
    free(f->path);
    free(f);
    *file = NULL;
}

int nn_safetensors_count(const nn_file *file) { return file->tensors; }
const char *nn_safetensors_name(const nn_file *file, int i) { return file->tensor[i].name; }
const char *nn_safetensors_path(const nn_file *file) { return file->path; }
const char *nn_safetensors_meta_key(const nn_file *file, int i) { return i < file->metas ? file->meta[i].key : NULL; }

const char *nn_safetensors_meta(const nn_file *file, const char *key)
{
    for (int i = 0; i < file->metas; i++)
        if (!strcmp(file->meta[i].key, key)) return file->meta[i].value;
    return NULL;
}

static const entry *find(const nn_file *file, const char *name)
{
    entry wanted = {.name = name};
    const entry *key = &wanted, **found = NULL;
    if (file->tensors) found = bsearch(&key, file->sorted, (size_t)file->tensors, sizeof *file->sorted, by_name);
    return found ? *found : NULL;
}

bool nn_safetensors_has(const nn_file *file, const char *name) { return find(file, name) != NULL; }

/* IEEE 754 binary16 to binary32, exactly. */
static float from_half(uint16_t h)
{
    uint32_t sign = (uint32_t)(h & 0x8000) << 16, exponent = h >> 10 & 31, fraction = h & 0x3ff, bits;
    float f;
    if (exponent == 0) {
        f = (float)fraction * 0x1p-24f;
        memcpy(&bits, &f, 4);
    } else bits = (exponent == 31 ? 255u : exponent + 112) << 23 | fraction << 13;
    bits |= sign;
    memcpy(&f, &bits, 4);
    return f;
}

static void shape_text(int rank, const int64_t *dim, char *out, size_t size)
{
    size_t at = (size_t)snprintf(out, size, "[");
    for (int i = 0; i < rank && at < size; i++) at += (size_t)snprintf(out + at, size - at, "%s%lld", i ? ", " : "", (long long)dim[i]);
    if (at < size) snprintf(out + at, size - at, "]");
}

ts_code nn_safetensors_read(const nn_file *file, const char *name, int rank, const int64_t *dim, float *out, ts_status *st)
{
    const entry *e = find(file, name);
    if (!e) return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" is missing", file->path, name);
    if (e->rank != rank || memcmp(e->dim, dim, (size_t)rank * sizeof *dim) != 0) {
        char has[160], needs[160];
        shape_text(e->rank, e->dim, has, sizeof has);
        shape_text(rank, dim, needs, sizeof needs);
        return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" has the shape %s, not %s", file->path, name, has, needs);
    }
    if (!e->kind->readable)
        return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" has dtype %s: F32, F16 or BF16 is needed", file->path, name, e->kind->name);
    const unsigned char *from = file->data + e->begin;
    size_t count = (size_t)(e->end - e->begin) / (size_t)e->kind->size;
    if (e->kind->size == 4) memcpy(out, from, count * 4);
    for (size_t i = 0; e->kind->size == 2 && i < count; i++) {
        uint16_t h;
        memcpy(&h, from + 2 * i, 2);
        uint32_t bits = (uint32_t)h << 16; /* BF16 is the upper half of a float */
        if (e->kind->name[0] == 'F') out[i] = from_half(h);
        else memcpy(&out[i], &bits, 4);
    }
    return TS_OK;
}
