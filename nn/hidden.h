/* What one photograph says next to nothing of: the diffuse albedo of pixels whose light is nearly all mirrored, and F0
 * where next to nothing is. A first estimate that takes a highlight for too broad leaves a dark disk in diffuse there,
 * and F0 beside it is a guess. What is smooth in either map is then that of where it is seen; detail stays. */
#ifndef NN_HIDDEN_H
#define NN_HIDDEN_H
#include "render/scene_model.h"
#include "tensor/arena.h"

/* Changes maps' diffuse channels and F0: maps [size, size, channels] of a whole square; image [size, size, 3]: its
 * photograph, linear; number: of its scene. In at most 32 x 32 cells, with x the mean logarithm of a cell's albedo and
 * q the part of its radiance that is not mirrored, a tenth of it where the photograph is burnt out, the smooth field b
 * is the minimum of
 *     sum w (b - x)^2 + sum |b - b of each neighbour|^2,    w = (q / largest q)^6,
 * for each colour. The mean d of b - x over the colours is what the level differs by, the rest what the hue does:
 * albedo is multiplied by exp(p d + p' (b - x - d)), linear between the cells' centres. p' = h^2 / (h^2 + v), h = 1 - u
 * / largest u, is the part of a difference that a highlight most probably made: what it does to a logarithm has the
 * deviation h, and cells differ anyway by v, the variance of the hue's x weighted by w. Where a level ends a material
 * does: of d and of p's v, fields of x and x^2 whose neighbours hold together by m^2 / (m + D)^2 in place of 1, D the
 * mean square of what their colours differ by, m = .05 + .3 of the sum of their h^2. u is q as it were if the pixel's
 * albedo were the picture's mean: black ink mirrors most of its light too, and is no highlight. Then F0 likewise, with
 * the part that is mirrored as q, w = (q / largest q)^4, both parts by v of the whole picture, and y / (1 + y^2) of
 * each difference y: what differs by much more than a guess may be off by is another material. Where the mirrored part
 * is the same everywhere nothing changes. arena: for what it holds meanwhile. The same bytes for any number of threads.
 * TS_NOMEM with st. */
ts_code nn_fill_hidden(rd_grid grid, const float *image, const float number[RD_SCENE_NUMBERS], int channels,
                       ts_arena *arena, float *maps, ts_status *st);
#endif
