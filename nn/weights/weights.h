/* Weights and checkpoints as files; the metadata of safetensors carries the architecture. */
#ifndef NN_WEIGHTS_H
#define NN_WEIGHTS_H
#include "nn/weights/file.h"
#include "nn/model.h"

/* A writer of any named f32 blocks: used for weights (name "g.…", "h.…") and by the trainer for checkpoints. */
typedef struct nn_block {
    const char *name;
    int rank;
    int64_t dim[4];
    const float *data;
} nn_block;

/* Written to a temporary file beside path, fsynced, renamed; nothing is left on failure. */
ts_code nn_safetensors_write(const char *path, const nn_block *blocks, int count, const nn_meta *meta, int metas,
                             ts_status *st);

/* A model with its parameters from a file that says its own architecture. Tensors whose names begin with none of "g.",
 * "h." and "a." (a checkpoint's) are left alone. */
nn_model *nn_model_load(const char *path, ts_status *st);
/* values: the block to write, model->value or an EMA. Extra metadata may be given. TS_NUMERIC when a value is not
 * finite. */
ts_code nn_model_save(const nn_model *model, const float *values, const char *path, const nn_meta *extra, int extras,
                      ts_status *st);
/* Parameters that have the same name and shape are taken from the file; a model of several photographs takes those of a
 * model of one too, and is then blind to all but the first; one whose g is wider takes those of a narrower g, and
 * computes the same with channels that are there more than once; how many were, and were not, is returned through the
 * pointers. begun (model->params of them, or NULL): parameters that are so marked stay as they are and are not counted;
 * those taken are marked, for another file to give the rest. TS_FORMAT where none was taken. */
ts_code nn_model_init_from(nn_model *model, const char *path, bool *begun, int *taken, int *left, ts_status *st);
/* The same of an auto-encoder ("format" = NN_CODER_FORMAT and one key "coder.FIELD" each). */
#define NN_CODER_FORMAT "lgd-coder"
int nn_coder_to_meta(const nn_coder *c, nn_meta *meta, int capacity, char *text, size_t text_size);
ts_code nn_coder_from_file(const nn_file *file, nn_coder *c, ts_status *st);

/* The architecture to metadata ("format" = "lgd" and one key "arch.FIELD" each: NN_ARCH_META entries, NN_ARCH_TEXT
 * bytes of text are enough) and back. A field that came later is written only where it is not its default, and may be
 * missing. Returns the number of entries, -1 when capacity or text_size is too small. Keys that do not begin with
 * "arch." are free for other use. */
enum { NN_ARCH_META = 24, NN_ARCH_TEXT = 1024 };
int nn_arch_to_meta(const nn_arch *arch, nn_meta *meta, int capacity, char *text, size_t text_size);
ts_code nn_arch_from_file(const nn_file *file, nn_arch *arch, ts_status *st);
#endif
