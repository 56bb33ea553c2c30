/* Light that a lens scatters: the veil and the halo around what is much brighter than the rest. */
#ifndef IO_GLARE_H
#define IO_GLARE_H

/* image [size][size][3] of linear light, not clamped, in place: this share of each pixel's light goes to its
 * surroundings, a fifth to each of five averages, each twice as wide as the one before, from 2 to 32 pixels, whatever
 * the picture's size, so that the light falls off with the square of the distance, as stray light in lenses about does.
 * The picture's mean stays, but for what the border's pixels count twice. share 0 .. 1; size at least 1. */
void io_glare(int size, float share, float *image);
#endif
