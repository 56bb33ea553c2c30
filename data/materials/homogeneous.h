/* Materials that are the same all over the patch, as most samples of a material are. The families' vary as much between
 * halves of a patch as between its details, and a network that sees nothing else takes what a highlight leaves in a
 * photograph for a darker or brighter part of the material. */
#ifndef IO_HOMOGENEOUS_H
#define IO_HOMOGENEOUS_H
#include "data/materials/canvas.h"

/* Takes .6 to 1 of what varies slowly out of the logarithms of the diffuse colours and of the roughness: their cosine
 * waves of up to one and a half periods a patch. Means of the logarithms stay, details too, and values stay within
 * 0.004 .. 0.9 (roughness 0.02 .. 1) or the range that the patch had. Where a logarithm has a deviation above .4
 * different materials lie side by side: those colours, or that roughness, are left as they are. Draws from c->rng. */
void cv_homogeneous(io_canvas *c);
#endif
