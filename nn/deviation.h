/* How far from what a model says the steps may go. */
#ifndef NN_DEVIATION_H
#define NN_DEVIATION_H
#include "nn/model.h"

#define NN_LAPLACE 1.41421356f /* a Laplace density's standard deviation over its mean absolute error */

typedef struct nn_belief {
    int photographs; /* of the sample, 0 as 1; of more than one deviations of F0 and roughness are with their level */
    bool finer;      /* the photographs have more pixels than h wrote: what it lacks of them is still to be found */
    bool revised;    /* by h, which has read what a step would read, and of several photographs has found levels */
} nn_belief;

/* deviation [pixels][NN_SPREADS]: the standard deviations that the steps believe, of spread, the logarithms of the
 * maps' expected errors as nn_guess has them. */
void nn_deviations(int64_t pixels, const float *spread, nn_belief belief, int threads, float *deviation);

/* From deviations of belief {0} to those of a photograph whose scene is found, and the roughness' level with it. */
void nn_deviations_of_found_scene(int64_t pixels, int threads, float *deviation);
#endif
