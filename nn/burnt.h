/* Around what is burnt out. There a photograph says little, and where it begins to, beside a highlight's edge, a
 * pixel's step takes for gloss what is noise, blur or a tone curve: roughness and F0 get dots and rings. What these
 * maps change there is what the pixels around change with them (docs/math.md, S31). */
#ifndef NN_BURNT_H
#define NN_BURNT_H
#include "render/scene.h"
#include "tensor/arena.h"
#include <stdbool.h>

/* Pixels of a photograph of so many pixels a side from which one of them depends on another. */
int nn_burnt_reach(int side);

/* Whether nn_burnt_find has anything above 0 in the window: image [side][side][3] is the whole photograph. */
bool nn_burnt_any(rd_grid window, const float *image);

/* Of a window's photograph image [h, w, 3] how much each pixel goes with those around, [h, w] in the arena: min(1, 4 t)
 * with t the mean of (max image - 0.85) / 0.15, within [0, 1], by the triangle filter of a half-width of
 * nn_burnt_reach(grid.side) + 1, the window's edges repeated. NULL: no memory.
 * Here and below: away from edges that are not the photograph's by nn_burnt_reach the same bytes for any window and any
 * number of threads. */
float *nn_burnt_find(rd_grid grid, const float *image, ts_arena *arena);

/* step [h, w, channels], to be added to maps: of roughness and F0 D = maps + step - mean becomes D + burnt (E - D), E
 * being D by the same filter; maps + step ends in [-1, 1]. arena: for what is held meanwhile. False: no memory. */
bool nn_burnt_settle(rd_grid grid, const float *burnt, const float *mean, const float *maps, int channels,
                     ts_arena *arena, float *step);

/* Of roughness and F0 1 - burnt of the step is left. */
void nn_burnt_hold(rd_grid grid, const float *burnt, int channels, float *step);
#endif
