/* Weights and checkpoints as files; the metadata of safetensors carries the architecture. */
#ifndef NN_WEIGHTS_H
#define NN_WEIGHTS_H
#include "nn/model.h"
#include "nn/weights/file.h"

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

/* A model with its parameters from a file whose metadata has the architecture. Tensors whose names are
 * no network's (those of a checkpoint's moments) are ignored. */
nn_model *nn_model_load(const char *path, ts_status *st);
/* The same to compute with on a tape without gradients: weights that the file has as plain F16 are not in
 * model->value but stay in the file, which the model holds open, and are taken from there: their tape gets
 * ag_halves_from(tape, nn_model_halves, model). */
nn_model *nn_model_open(const char *path, ts_status *st);
/* values: the block to write, model->value or an EMA. Extra metadata may be given. TS_NUMERIC when a value is not
 * finite. */
ts_code nn_model_save(const nn_model *model, const float *values, const char *path, const nn_meta *extra, int extras,
                      ts_status *st);
/* Takes the parameters of the same name and shape from the file. A model of several photographs also takes those of a
 * model of one, and then ignores all but the first photograph. A wider g also takes those of a narrower g, with
 * channels duplicated, and computes the same. A g with fewer levels takes those of the upper ones, whose deepest level
 * was normalised there: it has to be trained again. taken and left: how many parameters were taken and were not. begun
 * (model->params of them, or NULL): marked parameters keep their values and are not counted; those taken are marked, so
 * that another file can supply the rest. TS_FORMAT when none was taken. */
ts_code nn_model_init_from(nn_model *model, const char *path, bool *begun, int *taken, int *left, ts_status *st);
/* The same of an auto-encoder ("format" = NN_CODER_FORMAT and one key "coder.FIELD" each). */
#define NN_CODER_FORMAT "lgd-coder"
int nn_coder_to_meta(const nn_coder *c, nn_meta *meta, int capacity, char *text, size_t text_size);
ts_code nn_coder_from_file(const nn_file *file, nn_coder *c, ts_status *st);

/* The architecture to metadata ("format" = "lgd" and one key "arch.FIELD" each: NN_ARCH_META entries, NN_ARCH_TEXT
 * bytes of text are enough) and back. A field that not every file has is written only when it is not the default.
 * Returns the number of entries, -1 when capacity or text_size is too small. Keys that do not begin with "arch." are
 * free for other use. */
enum { NN_ARCH_META = 32, NN_ARCH_TEXT = 1024 };
int nn_arch_to_meta(const nn_arch *arch, nn_meta *meta, int capacity, char *text, size_t text_size);
ts_code nn_arch_from_file(const nn_file *file, nn_arch *arch, ts_status *st);
#endif
