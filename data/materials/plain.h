/* Plain materials: print, laminate, film, paint, glaze. Their picture is in the diffuse colour alone: one gloss and
 * hardly any relief. In the families colour, gloss and relief come together, and where a network does not see the
 * latter two it takes a highlight of a smooth material for that of a rougher one seen from nearer. */
#ifndef IO_PLAIN_H
#define IO_PLAIN_H
#include "data/materials/canvas.h"

/* Leaves of the roughness' differences from its mean a part u^2, of the height a part v^2, u and v uniform in 0 .. 1.
 * In half of them the mean becomes a roughness of .15 to .75. Dielectrics (no F0 above .2) get one F0, the mean of
 * theirs; of others, metal in part or all over, F0 stays as it is. Draws from c->rng. */
void cv_plain(io_canvas *c);
#endif
