/* Ambient occlusion of a relief. */
#ifndef IO_OCCLUSION_H
#define IO_OCCLUSION_H
#include "tensor/status.h"
#include <stdbool.h>

/* How far the relief is searched, in sides of the square. */
#define IO_OCCLUSION_REACH 0.125f

/* occlusion [size][size]: of a uniform sky the part that each point sees, weighted by the cosine to its own normal: 1
 * is open. height [size][size] in sides of the square. The integral over the slices of a hemisphere between the two
 * horizons of each: Jimenez, Wu, Pesce and Jarabo, "Practical Realtime Strategies for Accurate Indirect Occlusion",
 * 2016, equations 7 to 10, seen from above. repeats: the relief goes on at its borders; else nothing is beyond them.
 * threads: 0: the process's number. */
void io_occlusion(int size, const float *height, bool repeats, float *occlusion, int threads);
#endif
