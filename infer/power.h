/* The strength of the light, from the photograph alone. */
#ifndef LGD_POWER_H
#define LGD_POWER_H
#include "nn/model.h"

/* factor: by what the views' powers are to be multiplied so that renderings of R_0 are as bright as the photographs:
 * least is the mean |log| of their ratio (values at most 1, plus 0.01), brought 0.2 stops nearer to 1, for so much R_0
 * errs without a reason (Luo et al. 2024, section 6, leaves the light's intensity to the network). A light that the
 * maps can follow gives 1: albedo and power cannot be told apart; what the maps cannot follow, an albedo above 1, is
 * found. image: [given][side][side][3], linear. In 1/8 .. 8; 1 where the photographs are black, or white. The tape has
 * no gradients. R_0, of which g's light is no part, is that of so many orientations (nn_input), and is left in r0
 * [g_size][g_size][channels] for what follows. */
ts_code lgd_fit_power(ag_tape *tape, const nn_model *model, const float *const *image, const rd_view *views, int given,
                      int side, int orientations, float *r0, double *factor, ts_status *st);
#endif
