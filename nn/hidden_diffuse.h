/* The diffuse albedo that a highlight hides. Of a pixel whose light is nearly all mirrored, a photograph says next to
 * nothing about diffuse, and a first estimate that takes the highlight for too broad leaves a dark disk there. What is
 * smooth in diffuse is then that of the surroundings; detail stays. */
#ifndef NN_HIDDEN_DIFFUSE_H
#define NN_HIDDEN_DIFFUSE_H
#include "render/scene_model.h"
#include "tensor/arena.h"

/* Changes maps' diffuse channels: maps [size, size, channels] of a whole square; image [size, size, 3]: its photograph,
 * linear; number: of its scene. In at most 32 x 32 cells, with x the mean log albedo of a cell and q the part of its
 * radiance that is not mirrored, a tenth of it where the photograph is burnt out, the smooth field b is the minimum of
 *     sum w (b - x)^2 + sum |b - b of each neighbour|^2,    w = (q / largest q)^6,
 * for each colour, and albedo is multiplied by exp(p (b - x)), linear between the cells' centres. p = h^2 / (h^2 + v),
 * h = 1 - q / largest q, is the part of a difference that a highlight most probably made: what it does to a logarithm
 * has the deviation h, and cells differ anyway by v, the variance of x weighted by w. Where the mirrored part is the
 * same everywhere nothing changes. arena: for what it holds meanwhile. The same bytes for any number of threads.
 * TS_NOMEM with st. */
ts_code nn_fill_hidden_diffuse(rd_grid grid, const float *image, const float number[RD_SCENE_NUMBERS], int channels,
                               ts_arena *arena, float *maps, ts_status *st);
#endif
