/* Surfaces that do not lie flat in the picture: curled paper, cloth, leather, worn ground. Real samples lean and
 * undulate by some degrees; a network that never saw that takes a highlight beside the middle for the flash's place
 * alone. */
#ifndef IO_UNEVEN_H
#define IO_UNEVEN_H
#include "data/materials/canvas.h"

/* Adds a slope of the whole patch (.01 to .2) and, to half of the patches, waves of .3 to 2 cycles a patch with an RMS
 * slope of .01 to .15 to c's height. Draws from c->rng. */
void cv_uneven(io_canvas *c);
#endif
