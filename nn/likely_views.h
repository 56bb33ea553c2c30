/* A photograph whose camera is not known. */
#ifndef NN_LIKELY_VIEWS_H
#define NN_LIKELY_VIEWS_H
#include "nn/model.h"

/* What the first guess tells g of such a photograph's camera: that it is not known (0), and that it is so many widths
 * of the sample above its centre, where 50 and 25 degrees are seen; and the parts of what g answers in the mean. From
 * far away counts for more: g takes real materials for nearer than they are. More of it would be better still on
 * captures of such, and worse on renderings from .98 widths. */
enum { NN_LIKELY_VIEWS = 3 };
extern const float nn_likely_distance[NN_LIKELY_VIEWS], nn_likely_part[NN_LIKELY_VIEWS];

/* How often the first guess tells g of a photograph of which known (nn_known) is true: NN_LIKELY_VIEWS where the camera
 * is guessed, else 1. */
int nn_likely_views(const nn_arch *a, int known);

/* g's guess of a photograph [1, S, S, 3] (docs/math.md, S33), of a camera that is not known in all of the views above;
 * the scene is then the mean of what g guesses in each, the distance of what it guesses and of what it was told. in: as
 * for nn_guess_from, with views, known and without tellings. On a tape without gradients. False after an error, which
 * the tape has. */
bool nn_guess_in_likely_views(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess);
#endif
