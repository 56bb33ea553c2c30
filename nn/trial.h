/* What maps of one sample lead to: some of the pixels, to which the photographs are compared, take all steps to the
 * most probable maps, of which the maps that are tried are the prior's mean. */
#ifndef NN_TRIAL_H
#define NN_TRIAL_H
#include "nn/model.h"
#include "render/posterior.h"

typedef struct nn_photos {
    const float *const *image; /* [given] of [side][side][3], linear */
    const rd_view *views;      /* [given] */
    int given, side, known;    /* at least 2 photographs; known: of nn_known, true of all views */
} nn_photos;

typedef struct nn_trial {
    int side, channels;
    float *r0, *tried; /* [side][side][channels]: R_0, and the maps that the caller tries */
    rd_grid grid;
    const nn_photos *photos;
    float *deviation, *image[NN_MAX_IMAGES], *maps, *step, *best, *misfit, *memory;
} nn_trial;

/* side x side pixels, or all where there are fewer, of r0 [from.side][from.side][channels] and its deviation
 * [from.side][from.side][NN_SPREADS]; each is compared with the photographs' pixels at its centre. photos is the
 * caller's until nn_trial_end. TS_NOMEM with st: then there is nothing to end. */
ts_code nn_trial_begin(rd_grid from, int side, const nn_photos *photos, const float *deviation, int channels,
                       const float *r0, nn_trial *trial, ts_status *st);
/* The mean over the pixels of log(1 + E) after steps from trial->tried (rd_search). */
double nn_trial_misfit(nn_trial *trial, const ts_prior *prior, int steps);
void nn_trial_end(nn_trial *trial);
#endif
