/* Relief that does not follow a material's colours: in most families bumps and colours have one origin, and a network
 * that sees nothing else takes every dark spot for a hollow. What is broad, a stone or a plank, has its relief and its
 * colour together in artists' materials too; what is fine has not. */
#ifndef IO_RELIEF_H
#define IO_RELIEF_H
#include "data/materials/canvas.h"

/* What of a material's relief is made anew. */
typedef struct cv_relief {
    bool exchanged, gloss; /* the height of another material; its roughness too */
    float shape, steeper; /* of an exchanged one what is broader than this (sigma, of what is seen) stays, so many times
                             as steep; 0: nothing */
    float waves, cycles;  /* RMS slope of broad waves below it, 0: none; their frequency in cycles a patch */
    float gain;           /* of the whole height */
} cv_relief;
/* At least one of them. Draws from c->rng. */
cv_relief cv_draw_relief(io_canvas *c);
/* height and roughness are of the other material; read where exchanged (gloss). Draws from c->rng. */
void cv_other_relief(io_canvas *c, const cv_relief *r, const float *height, const float *roughness);
#endif
