/* The lattice that a network leaves whose last layers make a square of pixels of each of its own (depth to space): what
 * pixel (a, b) of every square has more or less than its neighbours. It is faint, but a smooth surface mirrors it as a
 * grid. */
#ifndef NN_LATTICE_H
#define NN_LATTICE_H
#include "tensor/arena.h"

/* Takes it from maps [size][size][channels], encoded, of squares of period x period pixels, 2 <= period <= size. With d
 * a pixel's difference from the mean over a period around it in both directions, and w = 1 / (1 + (d / s)^2)^2, s =
 * 0.02, the lattice is sum w d / sum (w + 0.1) over the pixels of the same place in the squares around, 7 x 7 of them;
 * w is 0 where less than a period lies around. An evenly rising map does not change. What differs by much more than s,
 * as edges and cloth do, is the photograph's. arena: for what it holds meanwhile. The same bytes for any number of
 * threads. TS_NOMEM with st. */
ts_code nn_take_lattice(int period, int size, int channels, int threads, ts_arena *arena, float *maps, ts_status *st);
#endif
