/* Views and rows as the kernels take them, for render.c and the loss op. */
#ifndef RD_ROWS_H
#define RD_ROWS_H
#include "render/kernels/view.h"
#include "render/scene.h"
#include "tensor/team.h"

ts_shade_view rd_shade_view(const rd_view *view);
/* Row y of a grid; maps [h, w, channels]. */
ts_shade_row rd_shade_row(rd_grid grid, int y, const float *maps, int channels);
/* The pixel in the middle of part i of parts that size pixels are cut into. Where two are in the middle it is the one
 * and the other in turn: of an even number of parts a mirrored picture is read at the mirrored pixels. */
static inline int rd_middle(int i, int parts, int size) { return (size * (2 * i + 1) / parts - 1 + (i & 1)) / 2; }
#endif
