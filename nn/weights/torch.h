/* What torch.save writes (pytorch/torch/serialization.py, torch/_utils.py): the pickled objects that become tensors. */
#ifndef NN_TORCH_H
#define NN_TORCH_H
#include "nn/weights/file_internal.h"
#include "nn/weights/pickle.h"

/* Tags of PK_OBJECT. */
enum { TORCH_STORAGE = 1, TORCH_TENSOR = 2 };

typedef struct torch_storage {
    const char *key; /* length bytes */
    size_t length;
    nn_dtype dtype;
    int64_t numel;                  /* of the whole storage */
    int64_t view_offset, view_size; /* the part of it that this is: all, but in old files */
} torch_storage;

typedef struct torch_tensor {
    const torch_storage *storage;
    nn_dtype dtype;
    int64_t offset, dim[NN_RANK_MAX], stride[NN_RANK_MAX]; /* in numbers */
    int rank;
} torch_tensor;

/* The globals that torch.save writes for tensors, parameters, storages and OrderedDicts, and what calling them gives.
 */
extern const pk_hooks torch_hooks;
#endif
