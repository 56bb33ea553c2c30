/* Square pictures side by side, for people to look at. */
#ifndef LGD_PANELS_H
#define LGD_PANELS_H
#include "data/material.h"
#include "render/scene.h"

/* Copies picture (size x size x 3, values clamped to [0, 1]) to column, row of the grid of such panels that sheet is.
 */
void lgd_panel_put(io_image *sheet, int size, int column, int row, const float *picture);

/* The material under a view, to column, row. picture: a buffer of size x size x 3 values. */
void lgd_panel_render(io_image *sheet, int column, int row, const io_material *m, const rd_view *view, float *picture);

/* Diffuse, specular, roughness, normal (half of it plus a half) to columns column .. column + LGD_MAP_PANELS - 1 of
 * row; what is not a colour is prepared so that the sRGB file shows its value. picture as above. */
enum { LGD_MAP_PANELS = 4 };
void lgd_panel_maps(io_image *sheet, int column, int row, const io_material *m, float *picture);
#endif
