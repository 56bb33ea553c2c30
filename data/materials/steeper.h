/* Steeper materials: the relief of stone, brick, tile and folded leather in artists' materials is two to four times
 * that of the families. */
#ifndef IO_STEEPER_H
#define IO_STEEPER_H
#include "data/materials/canvas.h"

/* Multiplies the height of the whole canvas by one factor of 1 to 4 (uniform in the logarithm). Draws from rng alone.
 */
void cv_steeper(io_canvas *c, ts_rng *rng);
#endif
