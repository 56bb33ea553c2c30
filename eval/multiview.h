/* Captures under several known lights and cameras: one picture is the input, the others are compared with
 * re-renderings. */
#ifndef EV_MULTIVIEW_H
#define EV_MULTIVIEW_H
#include "data/capture.h"
#include "eval/metrics/lpips.h"
#include "eval/metrics/row.h"
#include "render/scene.h"

/* Makes the picture whose camera is nearest to the sample's axis the first; the others keep their order. */
void ev_capture_nearest_first(io_capture *c);

/* Light and camera of a picture. Its power is that of the input picture as ev_capture_input gives it where it is not
 * as_taken. */
rd_view ev_capture_view(const io_capture *c, int picture);

/* The first `inputs` pictures as lgd-infer --capture reads them: multiplied by lgd_capture_gain, then clamped to [0,
 * 1]. image: [inputs, size, size, 3]. */
void ev_capture_input(const io_capture *c, int inputs, bool as_taken, float *image);

/* Re-renderings of maps [size, size, channels] under each picture's own light and camera, in the capture's own
 * brightness. EV_RENDER (and EV_SSIM and EV_FLIP if perceptual, EV_LPIPS if lpips is not NULL) are means over pictures
 * inputs .. images-1; EV_EXPOSURE is the factor on the light, the same for all pictures, that gives the re-rendering
 * of picture 0 the least RMSE in gamma space: one picture fixes brightness only up to a factor. The rest is NaN: the
 * maps are unknown. NaN throughout when memory cannot be had. */
ev_row ev_capture_score(const io_capture *c, int inputs, const float *maps, int channels, bool perceptual,
                        ev_lpips *lpips);

/* image = the re-rendering of one picture with that exposure, linear, clamped. */
void ev_capture_render(const io_capture *c, int picture, const float *maps, int channels, double exposure,
                       float *image);
#endif
