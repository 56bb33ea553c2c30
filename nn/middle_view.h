/* A photograph whose camera is not known. */
#ifndef NN_MIDDLE_VIEW_H
#define NN_MIDDLE_VIEW_H
#include "nn/model.h"

/* The middle, in the logarithm, of the distances of the camera that training shows (fields of view from 12 to 75
 * degrees), in widths of the sample: 31.7 degrees. */
#define NN_MIDDLE_DISTANCE 1.76f

/* Of that in the mean with what g says of a camera that is not known. Half of it would be better still on captures of
 * real materials, whose cameras g takes for nearer than they are, and worse on renderings from .98 widths. */
#define NN_MIDDLE_PART 0.4f

/* How often the first guess tells g of a photograph of which known (nn_known) is true: 2 where the camera is guessed,
 * else 1. */
int nn_middle_tellings(const nn_arch *a, int known);

/* g's guess of a photograph [1, S, S, 3] (docs/math.md, S33). Where its camera is not known g is told both that and
 * that the camera is NN_MIDDLE_DISTANCE above the centre; the scene is then the mean of both guesses, its distance of
 * the first and of what the second was told. in: as for nn_guess_from, with views, known and without tellings. On a
 * tape without gradients. False after an error, which the tape has. */
bool nn_guess_in_middle_view(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess);
#endif
