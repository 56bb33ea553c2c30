/* Inside nn only: the parts of the unrolled loop. */
#ifndef NN_LGD_INTERNAL_H
#define NN_LGD_INTERNAL_H
#include "nn/layers.h"
#include "tensor/resample.h"

int nn_given(const nn_input *in);
int nn_materials(const nn_input *in);
int nn_times_told(const nn_input *in);

/* Under which a photograph was taken, as the model's renderer has it. */
rd_view nn_view_of(const nn_model *model, const nn_input *in, int photograph);

/* What g reads beside the photographs: [tellings N, g_size, g_size, NN_CONDITIONS images] (nn/layers.h). NULL after an
 * error. */
ag_value *nn_conditions(ag_tape *tape, const nn_model *model, const nn_input *in);

/* The input fits the model, and no error is on the tape; else the tape gets one. */
bool nn_input_check(ag_tape *tape, const nn_model *model, const nn_input *in);

/* The RMSE of the photographs by maps, which scales all later gradients: of the whole photographs where they are given,
 * maps then being theirs. */
bool nn_measure_start(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, nn_state *state);

bool nn_descends(const nn_model *model, nn_descent how);

/* From maps [N, H, W, channels] of in's grid and the photographs: gradient [N, H, W, images channels], encoded for h,
 * and newton [N, H, W, channels]; either may be NULL. rmse0: of each photograph. False without memory. */
bool nn_read(ag_tape *tape, const nn_model *model, const nn_input *in, const ts_tensor *maps, const double *rmse0,
             float *gradient, float *newton);

/* Memory for the gradients of R_t (given) and of two states of gru channels, twice: those of a step and of the next
 * take turns. False after an error, which the tape has. */
bool nn_gradient_buffers(ag_tape *tape, const ag_value *maps, int gru, float *buffer[2][3]);

/* R_{t+1} by h from what was read, gradient and newton being constants (or NULL where they are not needed). */
ag_value *nn_apply(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *gradient,
                   ag_value *newton, nn_state *state);

/* The photographs, [n, h, w, 3], resampled to size x size, in the tape's arena. False after an error, which the tape
 * has. */
bool nn_resized(ag_tape *tape, const ts_tensor *photographs, int size, ts_tensor *to);

/* R_t, first at g's size and from the first step on at the coarse one, and what its steps carry. */
typedef struct nn_coarse {
    int side;         /* of the whole photographs */
    nn_input in;      /* these, or, where they are larger than NN_COARSE_READS times the coarse size, of that size */
    ts_taps up, down; /* between the coarse size and theirs */
    ag_value *maps;
    nn_state state;
    float *buffer[2][3]; /* nn_gradient_buffers, where steps are computed again for the gradient */
} nn_coarse;

/* R_0. False after an error, which the tape has. */
bool nn_coarse_begin(ag_tape *tape, const nn_model *model, const nn_input *in, nn_coarse *c);

/* A step. Gradient and Newton step are computed at up to NN_COARSE_READS times the size of the maps and averaged: a
 * photograph that is resampled to the maps' size is not a photograph of resampled maps. */
enum { NN_COARSE_READS = 2 };
bool nn_coarse_step(ag_tape *tape, const nn_model *model, nn_coarse *c);
#endif
