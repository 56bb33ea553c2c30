/* The published network's checkpoints: the names of its tensors, and its architecture from their shapes. */
#ifndef NN_PUBLISHED_H
#define NN_PUBLISHED_H
#include "nn/model.h"
#include "nn/weights/file.h"

/* The published code's name of a layer: "g.down2.conv1" -> "preprocess_net.down2.conv.conv.0". False: it has no such
 * layer. */
bool nn_published_name(const char *ours, char *theirs, size_t size);

/* Does the name belong to a tensor of it? */
bool nn_published_tensor(const char *name);

/* Does the file hold tensors with such names? */
bool nn_published_file(const nn_file *file);

/* The architecture of such a file: widths, levels and kernels are read from the tensors' shapes, the rest is as
 * published. TS_FORMAT when the shapes fit no such network; nn_model_load checks that every tensor is present. */
ts_code nn_published_arch(const nn_file *file, nn_arch *arch, ts_status *st);
#endif
