/* Detail finer than R_0's pixels. A photograph of more pixels than g reads shows what no map of R_0 has. Where the
 * light's power is not known the steps believe little of what differs from R_0's rendering, since exposure, tone curve
 * and lens make most of it; but these vary slowly. What differs from one of g's pixels to the next within them is the
 * material's. */
#ifndef LGD_DETAIL_H
#define LGD_DETAIL_H
#include "render/posterior.h"
#include "tensor/arena.h"
#include "tensor/resample.h"

/* levels [h, w, LGD_DETAIL_LEVELS], of the rendering L of maps [h, w, channels] under view, cut to [0, 1] as a
 * photograph is, and of the photograph image [1, any, any, 3], reduced to as many pixels: (L + .004) / (I + .004) of
 * each colour, within [1/4, 4], and how far detail is to be trusted: 1 where the largest value of the 5 x 5 pixels
 * around is .75 at most, 0 from TS_NEWTON_BURNT on. arena: for what it holds meanwhile. TS_NOMEM with st. */
enum { LGD_DETAIL_LEVELS = 4 };
ts_code lgd_detail_compare(rd_grid grid, const float *maps, int channels, const rd_view *view, const ts_tensor *image,
                           ts_arena *arena, float *levels, ts_status *st);

/* Of a window of the full size: the photograph image [h, w, 3] is multiplied by levels, enlarged by the taps, so that
 * it is as bright as the rendering everywhere, and maps [h, w, channels] take that part of the step to their most
 * probable ones (render/posterior.h) that is trusted, as if the light's power were known. deviation: [h, w,
 * MAP_GROUPS], of maps. arena: for what it holds meanwhile. The same bytes for any number of threads. TS_NOMEM with
 * st. */
ts_code lgd_detail_add(rd_grid grid, const ts_taps *rows, const ts_taps *columns, const float *levels,
                       const float *image, const rd_view *view, const float *deviation, int channels, ts_arena *arena,
                       float *maps, ts_status *st);
#endif
