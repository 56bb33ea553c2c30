/* The strength of the light, from the photograph alone. */
#ifndef LGD_POWER_H
#define LGD_POWER_H
#include "nn/model.h"

/* factor, 1/8 .. 8: what the views' powers are to be multiplied by so that renderings of R_0 are as bright as the
 * photographs. It minimises the mean of |log (photograph + 0.01) - log (rendering + 0.01)|, both clipped at 1, and is
 * then brought 0.2 stops nearer to 1, since R_0 errs by that much under the default light (Luo et al. 2024, section 6,
 * leaves the light's intensity to the network). Albedo and power cannot be distinguished where the maps can follow
 * both: the factor is then 1. It is 1 too where the photographs are all black or all white. image:
 * [given][side][side][3], linear. orientations: as in nn_input. r0, [nn_arch_side][nn_arch_side][channels], gets R_0,
 * which does not depend on the light, for what follows. The tape has no gradients. */
ts_code lgd_fit_power(ag_tape *tape, const nn_model *model, const float *const *image, const rd_view *views, int given,
                      int side, int orientations, float *r0, double *factor, ts_status *st);
#endif
