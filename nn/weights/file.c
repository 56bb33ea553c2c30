/* Opens a file of tensors, finds a tensor in it, and checks that names are unique. */
#include "nn/weights/file_internal.h"
#include "tensor/hash.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static int by_name(const void *a, const void *b)
{
    return strcmp((*(const nn_tensor *const *)a)->name, (*(const nn_tensor *const *)b)->name);
}

static ts_code sort_names(nn_file *f, ts_status *st)
{
    f->sorted = malloc(((size_t)f->tensors + 1) * sizeof *f->sorted);
    if (!f->sorted) return ts_fail(st, TS_NOMEM, "%s: no memory for the list of tensors", f->path);
    for (int i = 0; i < f->tensors; i++) f->sorted[i] = &f->tensor[i];
    if (f->tensors) qsort(f->sorted, (size_t)f->tensors, sizeof *f->sorted, by_name);
    for (int i = 1; i < f->tensors; i++)
        if (!strcmp(f->sorted[i - 1]->name, f->sorted[i]->name))
            return ts_fail(st, TS_FORMAT, "%s: tensor \"%.200s\" is there twice", f->path, f->sorted[i]->name);
    if (f->metas > 1000)
        return ts_fail(st, TS_FORMAT, "%s: %d metadata keys (at most 1000)", f->path,
                       f->metas); /* compared in pairs below */
    for (int i = 0; i < f->metas; i++)
        for (int j = 0; j < i; j++)
            if (!strcmp(f->meta[i].key, f->meta[j].key))
                return ts_fail(st, TS_FORMAT, "%s: metadata key \"%.80s\" is there twice", f->path, f->meta[i].key);
    return TS_OK;
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

uint64_t nn_file_hash(const nn_file *file) { return ts_hash(file->map, file->size, 0); }

enum { NAMES = 64 << 10 }; /* bytes of most files' names and metadata */

static nn_file *open_with(const char *path, ts_code (*parse)(nn_file *f, ts_status *st), ts_status *st)
{
    nn_file *f = calloc(1, sizeof *f);
    if (f) f->path = strdup(path);
    if (!f || !f->path) ts_fail(st, TS_NOMEM, "%s: no memory to open it", path);
    else if ((f->arena = ts_arena_create(NAMES, st)) && !map_file(f, st) && !parse(f, st) && !sort_names(f, st))
        return f;
    nn_file_close(&f);
    return NULL;
}

nn_file *nn_safetensors_open(const char *path, ts_status *st) { return open_with(path, nn_safetensors_parse, st); }

static ts_code parse_any(nn_file *f, ts_status *st)
{
    return nn_torch_is_zip(f) || nn_torch_is_old(f) ? nn_torch_parse(f, st) : nn_safetensors_parse(f, st);
}

nn_file *nn_file_open(const char *path, ts_status *st) { return open_with(path, parse_any, st); }

void nn_file_close(nn_file **file)
{
    nn_file *f = *file;
    if (!f) return;
    if (f->map) munmap((void *)(uintptr_t)f->map, f->size);
    for (int i = 0; i < f->inflations; i++) free(f->inflated[i]);
    free(f->inflated);
    free(f->tensor);
    free(f->sorted);
    free(f->meta);
    ts_arena_destroy(&f->arena);
    free(f->path);
    free(f);
    *file = NULL;
}

nn_form nn_file_form(const nn_file *file) { return file->form; }
int nn_file_count(const nn_file *file) { return file->tensors; }
const nn_tensor *nn_file_tensor(const nn_file *file, int i) { return &file->tensor[i]; }
const char *nn_file_name(const nn_file *file, int i) { return file->tensor[i].name; }
const char *nn_file_path(const nn_file *file) { return file->path; }
const char *nn_file_meta_key(const nn_file *file, int i) { return i < file->metas ? file->meta[i].key : NULL; }

const char *nn_file_meta(const nn_file *file, const char *key)
{
    for (int i = 0; i < file->metas; i++)
        if (!strcmp(file->meta[i].key, key)) return file->meta[i].value;
    return NULL;
}

const nn_tensor *nn_file_find(const nn_file *file, const char *name)
{
    nn_tensor wanted = {.name = name};
    const nn_tensor *key = &wanted, **found = NULL;
    if (file->tensors) found = bsearch(&key, file->sorted, (size_t)file->tensors, sizeof *file->sorted, by_name);
    return found ? *found : NULL;
}

bool nn_file_has(const nn_file *file, const char *name) { return nn_file_find(file, name) != NULL; }

void nn_shape_text(int rank, const int64_t *dim, char *out, size_t size)
{
    size_t at = (size_t)snprintf(out, size, "[");
    for (int i = 0; i < rank && at < size; i++)
        at += (size_t)snprintf(out + at, size - at, "%s%lld", i ? ", " : "", (long long)dim[i]);
    if (at < size) snprintf(out + at, size - at, "]");
}

const nn_tensor *nn_file_find_real(const nn_file *file, const char *name, int rank, const int64_t *dim, ts_status *st)
{
    const nn_tensor *e = nn_file_find(file, name);
    if (!e) return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" is missing", file->path, name), NULL;
    if (e->rank != rank || memcmp(e->dim, dim, (size_t)rank * sizeof *dim) != 0) {
        char has[160], needs[160];
        nn_shape_text(e->rank, e->dim, has, sizeof has);
        nn_shape_text(rank, dim, needs, sizeof needs);
        return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" has the shape %s, not %s", file->path, name, has, needs), NULL;
    }
    if (!nn_dtype_real(e->dtype))
        return ts_fail(st, TS_FORMAT, "%s: tensor \"%s\" has dtype %s: F32, F16, BF16 or F64 is needed", file->path,
                       name, nn_dtype_name(e->dtype)),
               NULL;
    return e;
}

ts_code nn_file_read(const nn_file *file, const char *name, int rank, const int64_t *dim, float *out, ts_status *st)
{
    const nn_tensor *e = nn_file_find_real(file, name, rank, dim, st);
    if (!e) return TS_FORMAT;
    nn_tensor_copy(e, NN_F32, out);
    return TS_OK;
}

ts_code nn_file_read_finite(const nn_file *file, const char *name, int rank, const int64_t *dim, float *out,
                            ts_status *st)
{
    const nn_tensor *e = nn_file_find_real(file, name, rank, dim, st);
    if (!e) return TS_FORMAT;
    return nn_tensor_finite(e, out)
        ? TS_OK
        : ts_fail(st, TS_NUMERIC, "%s: tensor \"%s\" holds a value that is not finite", file->path, name);
}
