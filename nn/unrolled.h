/* Inside nn only: the parts of the unrolled loop. */
#ifndef NN_UNROLLED_H
#define NN_UNROLLED_H
#include "nn/layers.h"

int nn_given(const nn_input *in);
int nn_materials(const nn_input *in);

/* Under which a photograph was taken, as the model's renderer has it. */
rd_view nn_view_of(const nn_model *model, const nn_input *in, int photograph);

/* The input fits the model, and no error is on the tape; else the tape gets one. */
bool nn_input_check(ag_tape *tape, const nn_model *model, const nn_input *in);

/* The whole photographs, linear, resampled to g_size: small is the input that the coarse steps have. False after an error. */
bool nn_reduce(ag_tape *tape, const nn_model *model, const nn_input *in, nn_input *small);

/* R_0 of reduced photographs: [N, g_size, g_size, channels]. */
ag_value *nn_propose(ag_tape *tape, const nn_model *model, const nn_input *small);

/* The RMSE of the photographs by maps, which scales all later gradients: of the whole photographs where they are given, maps then being theirs. */
bool nn_measure_start(ag_tape *tape, const nn_model *model, const nn_input *in, const ag_value *maps, nn_state *state);

/* nn_refine by h or by the coarse steps' network. */
ag_value *nn_refine_by(ag_tape *tape, const nn_model *model, const nn_refiner *h, const nn_input *in, ag_value *maps, nn_state *state);
#endif
