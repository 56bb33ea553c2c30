/* The families of procedural materials: each function paints a cleared canvas (height 0) from its random numbers alone.
 */
#ifndef IO_FAMILY_H
#define IO_FAMILY_H
#include "data/materials/palette.h"
#include "data/materials/weathering.h"

void io_family_stone(io_canvas *c);    /* natural rock: layered, cracked, pitted, with lichen */
void io_family_marble(io_canvas *c);   /* polished marble, onyx, granite, terrazzo */
void io_family_brick(io_canvas *c);    /* brick walls */
void io_family_paving(io_canvas *c);   /* cobbles, rubble walls, flagstones */
void io_family_tile(io_canvas *c);     /* glazed, stone, glass and metal tiles, squares and hexagons, grout */
void io_family_wood(io_canvas *c);     /* planks and boards, raw, oiled, varnished; bark */
void io_family_cloth(io_canvas *c);    /* plain, twill, satin and basket weaves, knits */
void io_family_leather(io_canvas *c);  /* grained, creased, quilted, patchwork */
void io_family_brushed(io_canvas *c);  /* bare metal: brushed, turned, sanded, cast, polished */
void io_family_rust(io_canvas *c);     /* corroded metal: rust, verdigris, tarnish */
void io_family_plaster(io_canvas *c);  /* plaster, stucco, painted walls */
void io_family_concrete(io_canvas *c); /* cast, rough, with aggregate, holes, form marks */
void io_family_ground(io_canvas *c);   /* soil, gravel, sand, mud, moss, puddles */
void io_family_paint(io_canvas *c);    /* painted and worn layers over metal, wood and wall; stripes and decals */
void io_family_panels(io_canvas *c);   /* metal and plastic panels: seams, rivets, screws, slots */
void io_family_embossed(io_canvas *c); /* tread plate, studs, scales, hammered and perforated sheet */
void io_family_plastic(io_canvas *c);  /* plastic, rubber, lacquer, paper: grained, ribbed, smooth */

/* Those whose relief, colour and gloss are joined by data/materials/finish.h. */
void io_family_masonry(io_canvas *c);  /* uneven bricks with deep joints and chipped edges */
void io_family_cobbles(io_canvas *c);  /* domed stones and setts */
void io_family_woven(io_canvas *c);    /* weaves with real crossings, dyed by the thread */
void io_family_knitted(io_canvas *c);  /* rows of loops */
void io_family_hide(io_canvas *c);     /* leather of fine cells and creases */
void io_family_scales(io_canvas *c);   /* overlapping scales and shingles */
void io_family_rough(io_canvas *c);    /* rough stone and plaster, markings apart from the relief */
void io_family_foam(io_canvas *c);     /* foam, sponge, pumice */
void io_family_polished(io_canvas *c); /* polished stone and glazed tile, F0 up to .2 */
void io_family_alloy(io_canvas *c);    /* all common metals, bare, corroded, painted, inlaid */
void io_family_bark(io_canvas *c);     /* furrows and plates, moss */
void io_family_pebbles(io_canvas *c);  /* rounded stones of several sizes on sand */
void io_family_creased(io_canvas *c);  /* crumpled foil, paper, film */
void io_family_stamped(io_canvas *c);  /* metal and other sheet stamped with a pattern */
void io_family_granite(io_canvas *c);  /* grains of several minerals, polished, honed or flamed */
void io_family_printed(io_canvas *c);  /* paper, card, wrapping: bold shapes without relief */
void io_family_faces(io_canvas *c);    /* tiles, blocks and panels whose faces lean, each another way */
void io_family_pierced(io_canvas *c);  /* sheets with holes and slots, mostly dark behind them */
void io_family_lattice(io_canvas *c);  /* cane, wicker, mesh, netting: strands over a gap */
#endif
