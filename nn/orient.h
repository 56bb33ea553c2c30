/* The eight orientations of a square picture: a number k of three bits, mirrored in x, mirrored in y, and transposed.
 */
#ifndef NN_ORIENT_H
#define NN_ORIENT_H

enum { NN_ORIENTATIONS = 8 };

/* Orientation k of a picture [side, side, channels]. */
void nn_turn(int k, int side, int channels, const float *from, float *to);
/* Maps [side, side, channels] of orientation k of a picture as those of the picture: the normals turn too. */
void nn_turn_maps_back(int k, int side, int channels, const float *from, float *to);
/* x to the right and y up of a place or direction of the picture, as they are in its orientation k. */
void nn_turn_vector(int k, const float from[2], float to[2]);
#endif
