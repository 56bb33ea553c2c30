/* Images and gradients from maps. Maps are [h, w, channels] with channels >= MAP_CHANNELS in the encoding of
 * tensor/maps.h; values outside [-1, 1] are clamped (no gradient there), as is |n_xy| (see render/brdf.h for the
 * equations and guards). Threaded; the same bytes for any number of threads. */
#ifndef RD_RENDER_H
#define RD_RENDER_H
#include "render/scene.h"
#include "tensor/tensor.h"

/* Linear radiance, [h, w, 3], >= 0, finite for any finite or non-finite maps. clamp: also <= 1, as the flash photograph
 * is. */
void rd_render(rd_grid grid, const float *maps, int channels, const rd_view *view, bool clamp, float *image);

/* The same, not clamped, of an RD_POINT view whose light is a disk parallel to the sample, its centre at view->light:
 * the mean of points on Vogel's spiral ("A better way to construct the sunflower head", 1979), which turn (radians)
 * turns. Their number follows from the roughness: of a smooth surface 32. view->ambient is not read. */
void rd_render_disk(rd_grid grid, const float *maps, int channels, const rd_view *view, float radius, float turn,
                    float *image);

/* The reconstruction loss of one flash photograph: *rmse = sqrt(mean over h w 3 of (render - image)^2), render clamped
 * to [0, 1]. */
void rd_flash_rmse(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                   double *rmse);

/* The gradient that h reads (S5 of docs/math.md), without a tape: for every value
 *     gradient = 1e5 / (3 * 256^2) * sum_rgb (render - image) * d render / d map / max(rmse0, RD_RMSE_FLOOR)
 * which is 1e5 dRMSE/dmap at 256^2 and does not depend on the resolution. rmse0 is the RMSE of R_0 (rd_flash_rmse),
 * fixed over the refinement; gradient is [h, w, channels], zero in channels beyond the ninth and where render is
 * clamped.
 * *rmse (may be NULL) gets the RMSE of these maps. */
#define RD_RMSE_FLOOR 1e-4 /* at a perfect fit the residual is zero too: the floor only keeps 0/0 away */
void rd_flash_gradient(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                       double rmse0, float *gradient, double *rmse);

/* The Gauss-Newton step of each pixel by itself (S8 of docs/math.md, equation in render/kernels/newton.h): toward maps
 * that fit count photographs (RD_POINT views, image[k] [h, w, 3] belongs to views[k]), damped by
 * damping[MAP_CHANNELS] > 0 (Levenberg and Marquardt). step: [h, w, channels]; 0 in channels beyond
 * the ninth. Finite for finite maps. */
void rd_newton_step(rd_grid grid, const float *maps, int channels, const rd_view *views, const float *const *image,
                    int count, const float *damping, float *step);
#endif
