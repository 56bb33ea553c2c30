/* What a model says of a photograph before any step: R_0, how far it may be off, and the scene. */
#ifndef LGD_FIRST_GUESS_H
#define LGD_FIRST_GUESS_H
#include "nn/model.h"

typedef struct lgd_first_guess {
    float *r0, *deviation; /* [side][side][channels] and [side][side][NN_SPREADS], side = nn_arch_side, owned */
    float number[RD_SCENE_NUMBERS];
} lgd_first_guess;

/* For a model with arch.spread and arch.scene. image: side x side x 3, linear, clamped here; view: where camera and
 * light are supposed to be; known: what of it is true (nn_known); several: more photographs of the sample follow, and
 * the deviations of F0 and roughness are with their level, which they tell. The numbers of the scene that are not known
 * are the network's, then those of rd_scene_fit, whose prior they are; with them it finds the level of r0's roughness.
 * r0's diffuse is filled where the highlight hides it (infer/hidden_diffuse.h); of a light that is not known a part of
 * its place is taken for a slope of the sample (infer/lean.h). The caller frees after success. */
ts_code lgd_first_guess_make(ag_tape *tape, const nn_model *model, const float *image, int side, const rd_view *view,
                             int known, bool several, int orientations, lgd_first_guess *guess, ts_status *st);
void lgd_first_guess_free(lgd_first_guess *guess);
#endif
