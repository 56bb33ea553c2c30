/* Windows of a photograph. */
#ifndef NN_WINDOW_H
#define NN_WINDOW_H
#include "render/scene.h"
#include <stdbool.h>
#include <stddef.h>

bool nn_window_same(rd_grid a, rd_grid b);
size_t nn_window_pixels(rd_grid g);

/* The window and by pixels more at every side, as far as the photograph goes. */
rd_grid nn_window_grown(rd_grid g, int by);

/* to [count][part.h][part.w][channels] = the part of from [count][whole.h][whole.w][channels]; part lies in whole. to
 * may be from. */
void nn_window_crop(rd_grid whole, rd_grid part, int count, int channels, const float *from, float *to);
#endif
