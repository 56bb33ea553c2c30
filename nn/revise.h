/* h of a model with arch.revisions: at g's full size it revises what the steps have made of several photographs
 * (docs/math.md, S26). */
#ifndef NN_REVISE_H
#define NN_REVISE_H
#include "nn/kind.h"
#include "nn/model.h"

/* What a revision reads, and what it leaves: photographs of nn_arch_side pixels a side, of n materials. */
typedef struct nn_revision {
    int given;                  /* photographs of each material, 2 at least */
    ts_tensor image;            /* [n given, side, side, 3], linear in [0, 1] */
    const rd_view *views;       /* [n given]: the scenes that were found */
    const unsigned char *known; /* [n given] of nn_known: what of them was known before */
    ag_value *maps;             /* in and out: [n, side, side, channels], first R_0 */
    ag_value *spread;           /* in and out: [n, side, side, NN_SPREADS], as in nn_guess */
    int made;                   /* revisions so far */
    nn_kind kind;               /* what the sample is known to be: that map stays */
} nn_revision;

/* One revision. From R, which with spread is the prior, all steps to the most probable maps (render/posterior.h) lead
 * to R + d. h reads of each pixel E(I) of the first photograph, the mean of E(I) - E(L(R + d)) over all of them, E
 * being the encoding of g and L the rendering under a photograph's view, 4 d, what is left of the prior's deviations as
 * a part of them, the misfit, the number of photographs, R + d and spread, all of them constants for back-propagation.
 * It adds to R + d and to spread. False after an error, which the tape has. */
bool nn_revise(ag_tape *tape, const nn_model *model, nn_revision *r);

/* Bytes that a revision of one material from so many photographs takes on a tape without gradients, at most. */
double nn_revision_bytes(const nn_arch *a, int photographs);
#endif
