/* What a model that guesses the scene says of photographs before their steps. */
#ifndef LGD_GUESS_H
#define LGD_GUESS_H
#include "infer/lgd.h"
#include "nn/first_guess.h"

/* What is estimated from, in the order in which models read it. */
typedef struct lgd_given {
    const float *image[NN_MAX_IMAGES]; /* [side][side][3] each, of the caller */
    rd_view views[NN_MAX_IMAGES];
    unsigned char known[NN_MAX_IMAGES]; /* what of the views is true, nn_known */
    int order[NN_MAX_IMAGES];           /* the caller's number of each */
    int count, side;
    nn_kind kind;                /* of the sample, where it is told */
    const float *r0, *deviation; /* r0: where it is known, as in nn_input; deviation: of a model that says it */
} lgd_given;

/* The first guess from the first photograph in rd_capture_order. given gets its view, its r0 and deviation, which
 * are the tape's memory, and where o->power is wanted the exposures of all. */
ts_code lgd_guess_first(ag_tape *tape, const nn_model *net, lgd_given *given, const lgd_options *o,
                        nn_first_guess *guess, ts_status *st);

/* So many revisions (nn/revise.h) of the first guess from several photographs, in given and guess. seen: NULL, or
 * called with each R_t that is revised next, of g's size; false: it is not. made: how many there were. */
ts_code lgd_guess_revise(ag_tape *tape, const nn_model *net, lgd_given *given, int revisions,
                         bool (*seen)(int step, const float *maps, void *user), void *user, nn_first_guess *guess,
                         int *made, ts_status *st);

/* What of the views is true, of nn_known. A flash is beside the lens, at a place that is not known. */
int lgd_guess_known(const lgd_options *o);
#endif
