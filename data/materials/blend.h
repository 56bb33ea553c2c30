/* Two materials in one: every map, the relief too, is a weighted mean of both. */
#ifndef CV_BLEND_H
#define CV_BLEND_H
#include "data/materials/canvas.h"

/* c's painted values go to (1 - weight) c + weight other (weight 0 .. 1, pixel by pixel): convex combinations of pairs,
 * as in Deschaintre et al., "Single-Image SVBRDF Capture with a Rendering-Aware Deep Network", TOG 37(4), 2018. other
 * has c's size. */
void cv_blend(io_canvas *c, const io_canvas *other, float weight);
#endif
