/* A canvas for tests. */
#ifndef TESTS_GREY_CANVAS_H
#define TESTS_GREY_CANVAS_H
#include "data/materials/canvas.h"

/* A grey sheet of size x size pixels and roughness .5, the whole patch, in memory of CANVAS_ALL * size * size floats.
 * index: of its random numbers. */
io_canvas grey_canvas(float *memory, int size, uint64_t index);
#endif
