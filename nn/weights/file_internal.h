/* Shared by the readers and writers of nn/weights/file.h. */
#ifndef NN_FILE_INTERNAL_H
#define NN_FILE_INTERNAL_H
#include "nn/weights/file.h"
#include "tensor/arena.h"
#include "tensor/new_file.h"

struct nn_file {
    char *path;
    nn_form form;
    const unsigned char *map; /* the file */
    size_t size;
    ts_arena *arena;          /* names, metadata, whatever the form needs */
    nn_tensor *tensor;        /* in the file's order */
    const nn_tensor **sorted; /* by name */
    nn_meta *meta;
    int tensors, metas;
    void **inflated; /* memory of compressed storages */
    int inflations;
};

/* The next free tensor, zeroed, or the next pair of metadata; NULL: no memory. */
nn_tensor *nn_file_add(nn_file *f);
nn_meta *nn_file_add_meta(nn_file *f);
/* Strides of a row-major tensor, and count; false: an overflow. */
bool nn_tensor_shape(nn_tensor *e);

/* The forms' readers: f is mapped, tensors and metadata are to be filled in. */
ts_code nn_safetensors_parse(nn_file *f, ts_status *st);
ts_code nn_torch_parse(nn_file *f, ts_status *st);
bool nn_torch_is_zip(const nn_file *f);
bool nn_torch_is_old(const nn_file *f); /* not a ZIP archive: PyTorch before 1.6 */

/* What a tensor of that type is written as. */
nn_dtype nn_dtype_out(nn_dtype has, nn_dtype real);
/* The numbers of e as type to: e's own memory, or *work, which grows to what is needed (the caller frees it). */
const void *nn_tensor_bytes(const nn_tensor *e, nn_dtype to, const char *path, void **work, size_t *work_size,
                            ts_status *st);

/* The forms' writers. */
ts_code nn_safetensors_put(ts_new_file *o, const nn_tensor *tensor, int tensors, nn_dtype real, const nn_meta *meta,
                           int metas, bool (*stop)(void), ts_status *st);
ts_code nn_torch_put(ts_new_file *o, const nn_tensor *tensor, int tensors, nn_dtype real, const nn_meta *meta,
                     int metas, bool (*stop)(void), ts_status *st);
#endif
