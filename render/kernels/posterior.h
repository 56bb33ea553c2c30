/* The most probable maps of rows of pixels, given photographs and a Gaussian prior. render/posterior.h has the
 * equations. */
#ifndef TS_POSTERIOR_H
#define TS_POSTERIOR_H
#include "render/kernels/view.h"
#include "tensor/kernels/family.h"

/* The variance of a photograph's value I is model^2 + noise i + (gain i)^2, i = max(I, 0). */
typedef struct ts_prior {
    float hue[2]; /* of the diffuse values and of F0's, in [0, 1] */
    float model, noise, gain;
    float share; /* a colour's deviation, of values in [0, 1], is at most this part of its root mean square; 0: any */
} ts_prior;
/* Standard deviations of the prior are taken as TS_PRIOR_WIDEST where they are larger, and as 0 where they are not
 * above 0; variances of a photograph's value as TS_PRIOR_FINEST where they are smaller. */
#define TS_PRIOR_WIDEST 1e3f
#define TS_PRIOR_FINEST 1e-10f
/* What a colour's value of 0 counts as, so that it may move too. */
#define TS_PRIOR_BLACK 0.01f
/* Misfits are those of deviations of TS_PRIOR_NARROWEST at least. */
#define TS_PRIOR_NARROWEST 1e-6f
/* What a burnt-out value tells fades from a radiance of 1 to 1 + TS_PRIOR_FADE. A narrow fade makes a burnt-out pixel
 * jump between what it is told and the mean, from step to step, and rounding decides where it ends. */
#define TS_PRIOR_FADE 0.1f

/* Of each pixel of a row, along the steps: the maps of the least misfit yet, [count, MAP_CHANNELS], and that misfit,
 * [count]. begun: they are of earlier steps. */
typedef struct ts_search {
    float *best, *misfit;
    bool begun;
} ts_search;
/* Maps that fit worse than the best of their pixel go back until this part of the way from those is left. */
#define TS_SEARCH_BACK 0.25f

struct ts_posterior_kernels {
    /* step[count, channels]; mean[count, channels]; deviation[count, MAP_GROUPS]; after[count, MAP_GROUPS] and search
     * may be NULL, search of one photograph is. images[v][count, 3] belongs to views[v]. length: the part of a whole
     * step that maps go on by. Channels of step beyond the maps' become 0. */
    void (*step)(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const ts_prior *prior, const float *mean, const float *deviation, float length,
                 const ts_search *search, float *step, float *after);
};
TS_FAMILY(posterior)
#endif
