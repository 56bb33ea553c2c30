/* Weak light beside a photograph's own. */
#ifndef RD_AMBIENT_H
#define RD_AMBIENT_H
#include "render/scene.h"

/* Shares of the radiance that a flat matt sample, turned to the photograph's own light, has at its centre. */
typedef struct rd_ambient {
    float uniform[3];   /* from everywhere; a surface reflects diffuse (1 - F0) + F0 of it */
    float side[3];      /* from far away */
    float direction[3]; /* unit, toward that light, above the sample */
} rd_ambient;

/* Adds to image [h, w, 3], which is rendered under view (RD_POINT). Threaded. */
void rd_ambient_add(rd_grid grid, const float *maps, int channels, const rd_view *view, const rd_ambient *a,
                    float *image);
#endif
