/* Views and rows as the kernels take them, for render.c and the loss op. */
#ifndef RD_ROWS_H
#define RD_ROWS_H
#include "render/kernels/view.h"
#include "render/scene.h"
#include "tensor/team.h"

ts_shade_view rd_shade_view(const rd_view *view);
/* Row y of a grid; maps [h, w, channels]. */
ts_shade_row rd_shade_row(rd_grid grid, int y, const float *maps, int channels);
#endif
