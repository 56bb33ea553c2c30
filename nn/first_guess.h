/* What a model says of a photograph before any step: R_0, how far it may be off, and the scene. */
#ifndef NN_FIRST_GUESS_H
#define NN_FIRST_GUESS_H
#include "nn/kind.h"
#include "nn/model.h"

/* Where the light's power is not known g reads the photograph this many times as bright, and says an exposure that is
 * as much lower: it believes darker materials under a stronger light. Materials of training have albedos 2.2 times
 * those of artists' (the mean of v^(1/2.2), lgd-data --statistics); this is about half of it, in the logarithm. */
#define NN_READ_AT 0.7f

typedef struct nn_first_guess {
    float *r0;        /* [side][side][channels], side = nn_arch_side */
    float *spread;    /* [side][side][NN_SPREADS]: the logarithms of the maps' expected errors, as nn_guess has them */
    float *deviation; /* [side][side][NN_SPREADS]: the standard deviations that the steps believe */
    float number[RD_SCENE_NUMBERS];
    rd_view view; /* light and camera of number; the light's place and the camera's height as given where known */
} nn_first_guess;

/* How a photograph was taken. */
typedef struct nn_taken {
    rd_view view;    /* where camera and light are supposed to be */
    int known;       /* what of it is true, nn_known */
    int photographs; /* of the sample, with this one: of more the deviations of F0 and roughness are with their level,
                      * which they tell */
    nn_kind kind;    /* of the sample, where it is told */
} nn_taken;

/* From what g says (r0 and spread of guess, scene [2 RD_SCENE_NUMBERS]) of image [side][side][3], linear in [0, 1]:
 * the numbers of the scene that are not known are the network's, then those of rd_scene_fit, whose prior they are;
 * with them it finds the level of r0's roughness. r0 is taken as the sample's kind has it, first of all. r0's
 * diffuse and F0 are filled where they are not seen (nn/hidden.h); of a light that is not known a part of its place
 * is taken for a slope of the sample (nn/lean.h). Where the light's power is not known the scene is found once more
 * from what r0 is then. How much relief there is is decided before (nn/relief.h), and in the end normals face the
 * camera that was found (nn/facing.h). r0, spread and deviation are the caller's memory. arena: for what it holds
 * meanwhile. TS_NOMEM with st. */
ts_code nn_first_guess_settle(rd_grid grid, int channels, const float *image, const float *scene, const nn_taken *taken,
                              ts_arena *arena, nn_first_guess *guess, ts_status *st);

typedef struct nn_first_ask {
    const float *image; /* [side][side][3], linear, clamped here */
    int side;
    nn_taken taken;
    int orientations; /* as in nn_input */
} nn_first_ask;

/* For a model with arch.spread and arch.scene, on a tape without gradients, whose memory the guess is: until ag_reset,
 * or a scope of the caller's ends. */
ts_code nn_first_guess_make(ag_tape *tape, const nn_model *model, const nn_first_ask *ask, nn_first_guess *guess,
                            ts_status *st);
/* Bytes that it leaves on the tape. */
double nn_first_guess_bytes(const nn_arch *a);
#endif
