/* An auto-encoder of maps: what the method `latent` searches in (eval/methods/method_latent.c). Its parameters are
 * those of an nn_model, so that it is trained, averaged and saved as g and h are; its metadata is its own. */
#ifndef NN_CODER_H
#define NN_CODER_H
#include "autograd/tape.h"

typedef struct nn_model nn_model;

typedef struct nn_coder {
    int code;             /* channels of the code; 0: no auto-encoder */
    int width, width_max; /* level i has min(width * 2^i, width_max) channels */
    int levels;           /* the code has a 2^levels-th of the maps' side */
} nn_coder;

ts_code nn_coder_check(const nn_coder *c, ts_status *st);

/* Parameters are allocated and zero. The caller frees (nn_model_free). NULL and st on failure. */
nn_model *nn_coder_create(const nn_coder *c, ts_status *st);
/* From a file that nn_model_save wrote of one. */
nn_model *nn_coder_load(const char *path, ts_status *st);

/* Maps [N, S, S, 9] to their code [N, S / 2^levels, S / 2^levels, code], and back to maps in [-1, 1]. Convolutional:
 * any S that is a multiple of 2^levels. */
ag_value *nn_encode(ag_tape *tape, const nn_model *model, ag_value *maps);
ag_value *nn_decode(ag_tape *tape, const nn_model *model, ag_value *code);
#endif
