/* What joins relief, colour and gloss of a material: how steep its relief is, what lies in its crevices, how bright its
 * highlight is, which coat is over it. All but the coat work on the canvas alone; each holds a few planes of scratch.
 */
#ifndef IO_FINISH_H
#define IO_FINISH_H
#include "data/materials/canvas.h"

/* Scales the height, less its mean, so that slopes over a 64th of the patch have this root mean square in both
 * directions together. */
void fin_slope(io_canvas *c, float slope);
/* The same with a slope between lo and hi, uniform in the logarithm. */
void fin_relief(io_canvas *c, float lo, float hi);
/* Grain at 8 to 64 cycles a patch: relief of slopes up to steep, colour, gloss, or some of them; of the same shape or
 * of two. */
void fin_grain(io_canvas *c, float steep);
/* Broad waves of 1 to 10 cycles a patch in the height. */
void fin_swell(io_canvas *c);
/* The depths: darker by occlusion, dusty or as light as the rest; rougher or not; the heights: worn lighter and
 * smoother, or not. */
void fin_crevices(io_canvas *c);
/* Gloss that goes its own way: uniform, of another level, or with patches that nothing else shows. */
void fin_gloss(io_canvas *c);
/* F0 of what is no metal: mostly .03 to .05, polished now and then .08 to .2. */
void fin_level(io_canvas *c, float polished);
/* A clear layer over everything or in patches: varnish, lacquer or water, with its own gloss and F0, that fills what
 * lies deep. */
void fin_coat(io_canvas *c);
/* All of it in this order, as the dice fall. steep: of the grain; coat: how often there is one. */
void fin_any(io_canvas *c, float steep, float coat);

/* A bare metal of the right colour, clean or tarnished. */
io_substance fin_metal(io_canvas *c, float roughness);
/* A dielectric of F0 0.04 in a colour of the list, its roughness between lo and hi, now and then anywhere. */
io_substance fin_dielectric(io_canvas *c, const uint32_t *colours, int count, float lo, float hi);
#endif
