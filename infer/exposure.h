/* How much brighter one photograph of a sample was taken than another. */
#ifndef LGD_EXPOSURE_H
#define LGD_EXPOSURE_H
#include "render/scene.h"
#include "tensor/status.h"

/* What the view's power is to be multiplied by: e^(m / 2), m the median of log (photograph / rendering) of maps
 * [grid.side][grid.side][channels] over the values that are between .02 and .9 in both. Half of m is believed: maps of
 * another photograph err by about as much as exposures differ. 1 where fewer than 64 values tell.
 * image: [side][side][3], linear; each pixel of the maps is compared with the photograph's pixel at its centre. */
ts_code lgd_exposure_beside(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                            int side, double *factor, ts_status *st);
#endif
