/* The tensors and metadata of a file as its reader finds them. */
#include "nn/weights/file_internal.h"
#include <stdlib.h>

/* Room for one more item in an array of count items that grows by doubling from 16. NULL: no memory, the array is as it
 * was. */
static void *grow(void *array, int count, size_t size)
{
    if (count && (count < 16 || count & (count - 1))) return array;
    return realloc(array, (size_t)(count ? 2 * count : 16) * size);
}

nn_tensor *nn_file_add(nn_file *f)
{
    nn_tensor *grown = f->tensors < 1 << 29 ? grow(f->tensor, f->tensors, sizeof *f->tensor) : NULL;
    if (!grown) return NULL;
    f->tensor = grown;
    f->tensor[f->tensors] = (nn_tensor){.count = 1};
    return &f->tensor[f->tensors++];
}

nn_meta *nn_file_add_meta(nn_file *f)
{
    nn_meta *grown = f->metas < 1 << 29 ? grow(f->meta, f->metas, sizeof *f->meta) : NULL;
    if (!grown) return NULL;
    f->meta = grown;
    f->meta[f->metas] = (nn_meta){0};
    return &f->meta[f->metas++];
}

bool nn_tensor_shape(nn_tensor *e)
{
    e->count = 1;
    for (int i = e->rank - 1; i >= 0; i--) {
        e->stride[i] = e->count;
        if (__builtin_mul_overflow(e->count, e->dim[i], &e->count)) return false;
    }
    return true;
}
