/* h of a model with arch.revisions: at g's full size it revises R_0 and how far that may be off (docs/math.md, S26). */
#ifndef NN_REVISE_H
#define NN_REVISE_H
#include "nn/model.h"

/* What a revision reads, and what it leaves: photographs of nn_arch_side pixels a side, one of each material. */
typedef struct nn_revision {
    ts_tensor image;            /* [N, side, side, 3], linear in [0, 1] */
    const rd_view *views;       /* [N]: the scene that was found */
    const unsigned char *known; /* [N] of nn_known: what of the scene was known before */
    ag_value *maps;             /* in and out: [N, side, side, channels] */
    ag_value *spread;           /* in and out: [N, side, side, NN_SPREADS], as in nn_guess */
    ag_value *state;            /* in and out: [N, g_size, g_size, revise_width]; NULL before the first revision */
} nn_revision;

/* One revision. With d the step to the most probable maps from R (render/posterior.h, R being the prior's mean), G the
 * gradient of the reconstruction error, E the encoding of g and L the rendering under views, h reads of each pixel
 *     E(I), E(I) - E(L(R)), E(I) - E(L(R + d)), R, asinh(10 d), asinh(10 G), spread
 * and the directions to camera and light, all of them constants for back-propagation, and changes R as ag_change_maps
 * does, and spread by a sum. False after an error, which the tape has. */
bool nn_revise(ag_tape *tape, const nn_model *model, nn_revision *r);

/* Bytes that a revision of one material takes on a tape without gradients, at most. */
double nn_revision_bytes(const nn_arch *a);
#endif
