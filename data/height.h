/* Heights whose slopes are a material's normals. */
#ifndef IO_HEIGHT_H
#define IO_HEIGHT_H
#include "data/material.h"

/* height: [size][size], in patch widths, mean 0, up is toward the camera. The least-squares solution over all
 * differences of neighbouring pixels with free borders: Frankot and Chellappa, "A Method for Enforcing Integrability in
 * Shape from Shading Algorithms", PAMI 10(4), 1988, with cosines for their Fourier basis, so that nothing wraps around;
 * where maps repeat, all differences around the torus and Hartley's basis. Normals less than 3 degrees above the
 * horizon count as 3: steeper slopes are mostly errors of the estimate. threads 0: the process's number. TS_NOMEM. */
ts_code io_height(const io_material *m, bool repeats, float *height, int threads, ts_status *st);
/* c: [n][n], row k the orthonormal cosine sqrt(2/n) cos(pi k (j + 1/2) / n), k / 2 cycles over the patch. */
void io_cosines(int n, float *c);
#endif
