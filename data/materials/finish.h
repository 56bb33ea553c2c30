/* Finishing a painted canvas, so that relief, colour and gloss agree: the slope of the relief, the crevices, the
 * roughness, F0, a clear coat. Each holds a few scratch planes while it runs. */
#ifndef IO_FINISH_H
#define IO_FINISH_H
#include "data/materials/canvas.h"

/* Scales the height, less its mean, so that slopes over a 64th of what is seen have this root mean square in both
 * directions together. */
void fin_slope(io_canvas *c, float slope);
/* The same with a slope between lo and hi, uniform in the logarithm. */
void fin_relief(io_canvas *c, float lo, float hi);
/* Adds grain of 8 to 64 cycles a patch to some of relief (slopes up to steep), colour and roughness, drawn at random;
 * all from one noise, or the relief from a noise of its own. */
void fin_grain(io_canvas *c, float steep);
/* Adds heights that are linear in the triangles of the frame's lattice, 0 .. amount: chipped faces with sharp edges;
 * either: a square is folded along the one diagonal or the other, as a creased sheet is. */
void fin_facets(io_canvas *c, nz_frame f, bool either, float amount, uint32_t seed);
/* Broad waves of 1 to 10 cycles a patch in the height. */
void fin_swell(io_canvas *c);
/* Changes deep and high places, each at random: deep ones become darker (occlusion), dusty or neither, and perhaps
 * rougher; high ones perhaps lighter and smoother (wear). */
void fin_crevices(io_canvas *c);
/* Roughness that does not follow relief and colour: uniform, at another level, or with patches of its own. */
void fin_gloss(io_canvas *c);
/* F0 of dielectrics: mostly .03 to .05; with probability polished .08 to .2. */
void fin_level(io_canvas *c, float polished);
/* A clear layer over everything or in patches: varnish, lacquer or water, with its own roughness and F0. It fills deep
 * places. */
void fin_coat(io_canvas *c);
/* Waves, grain, stains, crevices, gloss, scratches, F0 and a clear layer in this order, most of them at random. steep:
 * of fin_grain; coat: the probability of the clear layer. */
void fin_any(io_canvas *c, float steep, float coat);

/* A bare metal of the right colour, clean or tarnished. */
io_substance fin_metal(io_canvas *c, float roughness);
/* A dielectric of F0 0.04 in a colour of the list, its roughness between lo and hi, at times in the whole range. */
io_substance fin_dielectric(io_canvas *c, const uint32_t *colours, int count, float lo, float hi);
#endif
