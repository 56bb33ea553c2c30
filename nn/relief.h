/* How much relief a photograph shows. Of smooth samples g makes faint slopes out of shades, which are smaller than what
 * it expects its own errors to be; of others the absolute error, which it learned from, leads to the median of the
 * slopes that it thinks possible, and that is flatter than their mean, the more so the less a photograph tells: of
 * broad shapes less than of fine ones, whose edges it sees. */
#ifndef NN_RELIEF_H
#define NN_RELIEF_H
#include "tensor/tensor.h"

/* Of the mean length of the normals' x and y over the mean of its expected errors: up to NN_RELIEF_NONE a sample is
 * flat, from NN_RELIEF_SURE on its relief is as g says. */
#define NN_RELIEF_NONE 0.1f
#define NN_RELIEF_SURE 0.25f
/* By which the slopes n_x / n_z and n_y / n_z of one photograph are multiplied beside that where the light's power is
 * not known: what NN_RELIEF_CELLS cells a side can show, and the rest. Several photographs show for themselves how
 * steep they are. */
#define NN_RELIEF_BROAD 1.7f
#define NN_RELIEF_FINE 1.1f
#define NN_RELIEF_CELLS 24

/* The slopes of maps [side][side][channels] are multiplied by what their size makes of them, and if steeper by the two
 * factors above; where that changes any, x and y of each normal end shorter together than 1. spread
 * [side][side][NN_SPREADS] as in nn_guess. The same bytes for any number of threads. arena: for what it holds
 * meanwhile. TS_NOMEM with st. */
ts_code nn_weigh_relief(int side, int channels, const float *spread, bool steeper, int threads, ts_arena *arena,
                        float *maps, ts_status *st);
#endif
