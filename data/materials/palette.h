/* Colours of real things, as ranges to draw from. */
#ifndef IO_PALETTE_H
#define IO_PALETTE_H
#include "data/materials/canvas.h"

/* One of count sRGB colours 0xRRGGBB, made linear and moved a little: brightness by up to spread (in stops), saturation
 * and hue slightly. */
void pal_pick(io_canvas *c, const uint32_t *colours, int count, float spread, io_rgb out);
/* A neighbour of a colour: brightness by up to stops, saturation and hue slightly. */
void pal_vary(io_canvas *c, const io_rgb in, float stops, io_rgb out);
void pal_scale(io_rgb colour, float factor);

/* Paint, glaze, dye or plastic: from white over greys to black, and common hues. */
void pal_paint(io_canvas *c, io_rgb out);

/* A dielectric with that colour: F0 mostly 0.04, between 0.02 and 0.06. */
io_substance pal_dielectric(io_canvas *c, const io_rgb colour, float roughness);
/* A bare metal: iron, steel, aluminium, chromium, zinc, nickel, silver, copper, bronze, brass, gold, and darker
 * oxidised ones. */
io_substance pal_metal(io_canvas *c, float roughness);

#define PAL_COUNT(list) ((int)(sizeof(list) / sizeof *(list)))
#endif
