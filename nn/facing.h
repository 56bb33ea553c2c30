/* What a camera sees faces it. Normals that g, a factor on its relief (nn/relief.h) or a step turned away from it are
 * black under a flash beside the lens, and no step finds back from there: black has no slope. */
#ifndef NN_FACING_H
#define NN_FACING_H
#include "render/scene.h"

/* The cosine between a normal and the direction v to the camera is NN_FACING at least, or what a flat sample has there
 * where that is less: normals of maps, [the grid's pixels, channels], that have less are turned towards the camera
 * until they have it, in the plane of both. Those whose x and y are longer together than 1 are made that long first.
 * camera: its place, in patch widths. The same bytes for any number of threads. */
#define NN_FACING 0.2f
void nn_face_camera(rd_grid grid, const float camera[3], int channels, float *maps);
#endif
