/* Materials of other hues: what a palette of natural colours does not have. */
#ifndef IO_HUES_H
#define IO_HUES_H
#include "data/materials/canvas.h"

/* Exchanges the channels of the diffuse colours, one of six ways for the whole canvas, and scales their saturation by
 * 0.6 to 2 (in the logarithm). Luminance's weights go with their channels' places, so brightness may change. F0 stays:
 * a dielectric's is grey, and that of a metal has the hue of a metal. Draws from rng alone. */
void cv_other_hues(io_canvas *c, ts_rng *rng);
#endif
