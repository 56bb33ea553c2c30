/* What time and use do to any material. */
#ifndef IO_WEATHERING_H
#define IO_WEATHERING_H
#include "data/materials/canvas.h"

/* Dirt of one colour: in cavities (as seen at the given radius), and in patches; it is rough. amount 0 .. 1. */
void wear_dirt(io_canvas *c, float radius, float amount);
/* Convex edges rubbed down to s (NULL: only lighter, and mostly smoother), broken up by noise. amount 0 .. 1. */
void wear_edges(io_canvas *c, float radius, float amount, const io_substance *s);
/* Fine lines: rougher or smoother, lighter or darker, slightly cut in. bare: what they lay open, or NULL. */
void wear_scratches(io_canvas *c, int count, float longest, const io_substance *bare);
/* Soft patches of another tone and roughness. */
void wear_stains(io_canvas *c, float amount);
/* Fine mottling of colour and roughness down to the pixel. */
void wear_grain(io_canvas *c, float frequency, float colour, float roughness);
/* Relief down to the pixel, of slopes up to about the given one: what a close photograph shows of any matt surface. */
void wear_texture(io_canvas *c, float frequency, float slope);
/* Prints, stickers and stencils (decal.c), partly rubbed off. */
void wear_decals(io_canvas *c);
/* Runs of rust, lime or dirt. */
void wear_streaks(io_canvas *c, float amount);
/* Water or oil in what lies below a level: smooth and dark. coverage 0 .. 1. */
void wear_wet(io_canvas *c, float coverage);
/* Smears and finger marks of roughness. */
void wear_smudges(io_canvas *c, float amount);
/* Some of all that, as the dice fall; the family's planes are dropped. harsh 0 (kept indoors) .. 1 (left outside). */
void wear_any(io_canvas *c, float harsh);
/* The last touch, so that a set of materials spreads as real ones do, from plain and flat to rich and deep: contrast of
 * colour and roughness about their means, depth of relief, gloss; and cavities a little rougher and darker than what
 * lies higher. */
void wear_calm(io_canvas *c);
#endif
