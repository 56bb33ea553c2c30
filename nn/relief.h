/* How much relief a photograph shows. Of smooth samples g makes faint slopes out of shades, which are smaller than what
 * it expects its own errors to be; of others the absolute error, which it learned from, leads to the median of the
 * slopes that it thinks possible, and that is flatter than their mean. */
#ifndef NN_RELIEF_H
#define NN_RELIEF_H
#include <stdint.h>

/* Of the mean slope over the mean expected error of normals: up to NN_RELIEF_NONE a sample is flat, from NN_RELIEF_SURE
 * on its relief is as g says. */
#define NN_RELIEF_NONE 0.1f
#define NN_RELIEF_SURE 0.25f
/* By which the slopes of one photograph are multiplied beside that where the light's power is not known; several show
 * for themselves how steep they are. */
#define NN_RELIEF_STEEPER 1.15f

/* The normals of maps [pixels, channels] are multiplied by one factor, steeper times what the relief's size makes of
 * it, each within [-1, 1]; spread [pixels, NN_SPREADS] as in nn_guess. The same bytes for any number of threads. */
void nn_weigh_relief(int64_t pixels, int channels, const float *spread, float steeper, int threads, float *maps);
#endif
