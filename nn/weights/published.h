/* The published network's checkpoints: what its tensors are called, and its architecture from their shapes. */
#ifndef NN_PUBLISHED_H
#define NN_PUBLISHED_H
#include "nn/weights/file.h"
#include "nn/model.h"

/* What the published code calls a layer: "g.down2.conv1" -> "preprocess_net.down2.conv.conv.0". False: it has no such
 * layer. */
bool nn_published_name(const char *ours, char *theirs, size_t size);

/* Does the name belong to a tensor of it? */
bool nn_published_tensor(const char *name);

/* Are there tensors in the file that are called so? */
bool nn_published_file(const nn_file *file);

/* The architecture of such a file: widths, levels and kernels are read from the tensors' shapes, the rest is as
 * published. TS_FORMAT where the shapes are no such network's; whether every tensor is there is nn_model_load's to
 * check. */
ts_code nn_published_arch(const nn_file *file, nn_arch *arch, ts_status *st);
#endif
