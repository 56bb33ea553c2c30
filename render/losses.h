/* The training losses as ops (render/op_NAME.c). All return one value. */
#ifndef RD_LOSSES_H
#define RD_LOSSES_H
#include "autograd/tape.h"
#include "render/scene.h"

/* mean over images, pixels, rgb and views of |log(a + 0.01) - log(b + 0.01)|, a and b the renderings of maps and target
 * ([N, S, S, 9], whole patches). views: N * views_per_image, image-major, copied. Value and gradient are made in one pass. */
ag_value *ag_render_loss(ag_tape *tape, ag_value *maps, ag_value *target, const rd_view *views, int views_per_image);

/* mean |maps - target| over all values, the map L1 of DESIGN section 4. Channel groups weighted equally by channel. */
ag_value *ag_map_loss(ag_tape *tape, ag_value *maps, ag_value *target);
#endif
