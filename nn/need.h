/* How much memory the network takes, known before it is taken: an architecture is metadata of a file. */
#ifndef NN_NEED_H
#define NN_NEED_H
#include "nn/model.h"

/* Bytes that nn_guess_from takes for one material on a tape without gradients, with so many orientations and tellings
 * (nn_input): what it holds at once, at most. An upper bound that is less than twice what is taken; packed weights and
 * the threads' scratch are not in it. */
double nn_guess_bytes(const nn_arch *a, int orientations, int tellings);
#endif
