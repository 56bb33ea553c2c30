/* How much brighter one photograph of a sample was taken than another. */
#ifndef LGD_EXPOSURE_H
#define LGD_EXPOSURE_H
#include "render/scene.h"
#include "tensor/status.h"

/* What the view's power is to be multiplied by: the root of the median of photograph / rendering of maps
 * [grid.side][grid.side][channels] over the values that are between .02 and .9 in both. A root, since maps of another
 * photograph err by about as much as exposures differ. 1 where fewer than 64 values tell.
 * image: [side][side][3], linear; each pixel of the maps is compared with the photograph's pixel at its centre. */
ts_code lgd_exposure_beside(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                            int side, double *factor, ts_status *st);

/* The power over the squared height of a view's light: as bright as it makes the middle of a sample. */
double lgd_irradiance(const rd_view *view);

/* The powers of views 1 .. count - 1, whose exposures are not known: factor is what the first one's irradiance turned
 * out to be over what was supposed. The rest of each is lgd_exposure_beside's. */
ts_code lgd_expose_others(rd_grid grid, const float *maps, int channels, int count, rd_view *views,
                          const float *const *image, int side, double factor, ts_status *st);
#endif
