/* Whether a sample is a metal. Of one photograph g decides it, and is wrong at times: bright diffuse and a rough
 * metal look alike. Steps from maps of the wrong kind end in maps of that kind, since on the way all are worse; several
 * photographs tell by how well the maps of either fit in the end. */
#ifndef NN_METAL_H
#define NN_METAL_H
#include "nn/trial.h"

/* NN_METAL_SIDE x NN_METAL_SIDE pixels of r0, [grid.side][grid.side][channels], are tried (nn/trial.h) with deviation,
 * [grid.side][grid.side][NN_SPREADS], as r0 reads and as were it of the other kind (nn/kind.h). Where the mean over
 * pixels of log(1 + E) is then less than NN_METAL_SURE of what it is as r0 reads, r0 becomes of that kind. Fails where
 * memory is out; r0 is then as it was. */
#define NN_METAL_SIDE 64
#define NN_METAL_SURE 0.9
ts_code nn_tell_metal(rd_grid grid, const nn_photos *photos, const float *deviation, int steps, int channels, float *r0,
                      ts_status *st);
#endif
