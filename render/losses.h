/* The losses as ops (render/op_NAME.c). Each returns one value. */
#ifndef RD_LOSSES_H
#define RD_LOSSES_H
#include "autograd/tape.h"
#include "render/scene.h"

/* M11 of docs/math.md: the mean over images, pixels, rgb and views of |log(a + 0.01) - log(b + 0.01)|, a and b the
 * renderings of maps and target ([N, S, S, 9], whole patches). views: N * views_per_image, image-major, copied. Value
 * and gradient are made in one pass. */
ag_value *ag_render_loss(ag_tape *tape, ag_value *maps, ag_value *target, const rd_view *views, int views_per_image);

/* The mean over the photographs of the RMSE (all pixels, rgb) between photograph and rendering under view, clamped to
 * [0, 1]: the reconstruction error. maps [N, S, S, 9 or more], image [N, S, S, 3] linear, whole patches. The
 * gradient at a perfect fit is 0 (render/render.h). */
ag_value *ag_flash_loss(ag_tape *tape, ag_value *maps, ag_value *image, const rd_view *view);

/* The maps [N, H, S, channels] from the first channels + 2 of x [N, H, S, C], the last two of which are parts of the
 * normal along and across the direction from the centre (render/op_shading_frame.c has the equation). x has rows top ..
 * top + H - 1 of squares of S rows. */
ag_value *ag_shading_frame(ag_tape *tape, ag_value *x, int channels, int top);

/* The mean over images of the root of the mean squared difference in channels first .. first + count - 1: as the
 * evaluation measures maps (docs/math.md, Evaluation), whose normals have three components. Where relief is uncertain
 * its best answer is the mean of what may be, that of L1 the median, which is flat. A squared error of 1e-6 is added,
 * for the gradient of a perfect image. */
ag_value *ag_rmse_loss(ag_tape *tape, ag_value *maps, ag_value *target, int first, int count);

/* The mean over images of that root's square: of all that may be its best answer is the mean where it is uncertain
 * whether an image has any relief too, and steep images weigh more. */
ag_value *ag_mse_loss(ag_tape *tape, ag_value *maps, ag_value *target, int first, int count);

/* mean w |maps - target| over all values, w the weight of their channel: the L1 of S15 in docs/math.md. weight: of the
 * nine channels, copied; NULL: 1. */
ag_value *ag_map_loss(ag_tape *tape, ag_value *maps, ag_value *target, const float *weight);
#endif
