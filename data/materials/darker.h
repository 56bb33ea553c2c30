/* Darker materials: artists' diffuse colours are about half as bright as the palettes'. */
#ifndef IO_DARKER_H
#define IO_DARKER_H
#include "data/materials/canvas.h"

/* Multiplies the diffuse colours of the whole canvas by one factor, down to an eighth (uniform in the logarithm). No
 * value falls below 0.004, or what it was if that is less. F0 stays: that of a dielectric does not follow its colour.
 * Draws from rng alone. */
void cv_darker(io_canvas *c, ts_rng *rng);
#endif
