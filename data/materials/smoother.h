/* Smoother materials: artists' materials are about .8 times as rough as the families'. */
#ifndef IO_SMOOTHER_H
#define IO_SMOOTHER_H
#include "data/materials/canvas.h"

/* Multiplies the roughness of the whole canvas by one factor of .45 to 1 (uniform in the logarithm). Draws from
 * rng alone. */
void cv_smoother(io_canvas *c, ts_rng *rng);
#endif
