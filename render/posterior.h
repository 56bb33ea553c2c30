/* The most probable maps, given photographs and a Gaussian prior on each pixel's nine values. With the maps R where the
 * rendering is linearised (encoded, tensor/maps.h), the prior's mean M and covariance Sigma, the residual
 * r = I - seen(R) and J = d seen / d maps, the step is the delta for which
 *     |r - J delta|^2 / S + (R + delta - M)' Sigma^-1 (R + delta - M)
 * is least, which is
 *     delta = M - R + Sigma J' (J Sigma J' + S)^-1 (r - J (M - R)).
 * R is cut to [-1, 1] first (why: render/kernels/observe_lanes.h). What is left of the prior's uncertainty afterwards
 * is Sigma - Sigma J' (J Sigma J' + S)^-1 J Sigma. Sigma has a standard deviation s for each of the four maps. The
 * values of different maps are independent, and so are the normal's x and y; the three values of the diffuse map and
 * the three of F0 have the covariance s^2 W ((1 - q) 1 1' + q I) W. W is diagonal and holds the colour of the mean: its
 * three values of [0, 1], each TS_PRIOR_BLACK more, over their root mean square, of which their s is ts_prior's share
 * at most. With a small q the three are multiplied by the same and keep their hue. S is diagonal: a value I of a
 * photograph has the variance model^2 + noise max(I, 0) + (gain I)^2. seen is the radiance up to 1 and
 * 1 + log(radiance) above; where it is above 1 and the photograph is TS_NEWTON_BURNT at least, r and J fade, and from
 * 1 + TS_PRIOR_FADE on nothing is learned. */
#ifndef RD_POSTERIOR_H
#define RD_POSTERIOR_H
#include "render/kernels/newton.h"
#include "render/kernels/posterior.h"
#include "render/scene.h"
#include "tensor/maps.h"

typedef struct rd_prior {
    const float *mean;      /* [h, w, channels], as the maps */
    const float *deviation; /* [h, w, MAP_GROUPS], of encoded values, >= 0 */
    ts_prior scale;
} rd_prior;

/* Along the steps of several photographs, whose highlights bend what a step takes for straight. With the misfit
 *     E(R) = |r|^2 / S + (R - M)' Sigma^-1 (R - M)
 * maps whose E is not above that of any before become the best of their pixel, and its step goes on; from others it
 * goes back until TS_SEARCH_BACK of the way from the best is left. */
typedef struct rd_search {
    float *best, *misfit; /* [h, w, MAP_CHANNELS] and [h, w], of the caller; each step reads and writes them */
    bool begun;           /* earlier steps have written them */
} rd_search;

/* The part of delta that the step after so many has. Of one photograph the first is whole, and the others are
 * RD_STEP_LATER: on glossy pixels whole steps swing from one side to the other, and rounding decides where they end. Of
 * several from RD_SEARCH_FIRST to RD_SEARCH_LONGEST: the first linear model is made farthest from the end, and a long
 * step along it leads to maps that no later step leaves. */
#define RD_STEP_LATER 0.5f
#define RD_SEARCH_FIRST 0.3f
#define RD_SEARCH_GROWTH 1.13f
#define RD_SEARCH_LONGEST 0.7f
float rd_step_length(int photographs, int steps);

/* step: length times delta, 0 < length <= 1, [h, w, channels], 0 in channels beyond the ninth; where maps +
 * delta would leave [-1, 1] delta ends there. after (may be NULL): [h, w, MAP_GROUPS], what is left of the prior's
 * standard deviations, of several values the root of their mean variance. Views are RD_POINT,
 * 1 <= count <= RD_CAPTURE_VIEWS; image[k] [h, w, 3] belongs to views[k]. search: NULL, and of one photograph always.
 * Finite for finite maps. Threaded; the same bytes for any number of threads. */
void rd_posterior_step(rd_grid grid, const float *maps, int channels, const rd_view *views, const float *const *image,
                       int count, const rd_prior *prior, float length, const rd_search *search, float *step,
                       float *after);

/* All steps, of the lengths above, from the prior's mean on: maps and step [h, w, channels], which become the last
 * maps and the last step. search: begun is not read, the rest as above; after: of the last step. */
void rd_posterior_steps(rd_grid grid, int channels, const rd_view *views, const float *const *image, int count,
                        const rd_prior *prior, int steps, rd_search search, float *maps, float *step, float *after);

/* The prior's covariance. */
void rd_prior_covariance(const double deviation[MAP_GROUPS], const double mean[MAP_CHANNELS], const ts_prior *prior,
                         double covariance[MAP_CHANNELS][MAP_CHANNELS]);

/* What a photograph's value says of a pixel's maps: the residual, its variance, and d seen / d maps. */
typedef struct rd_observation {
    double residual, variance, by[MAP_CHANNELS];
} rd_observation;
void rd_observe(const double maps[MAP_CHANNELS], const double point[2], const rd_view *view, const float image[3],
                const ts_prior *prior, rd_observation observation[3]);

/* The same step and covariance of one pixel in double, not clamped, one observation after the other (Kalman 1960): what
 * the kernel is tested against. mean and covariance are the prior's and become the posterior's. */
void rd_posterior_pixel(const double maps[MAP_CHANNELS], const double point[2], const rd_view *views,
                        const float (*image)[3], int count, const ts_prior *prior, double mean[MAP_CHANNELS],
                        double covariance[MAP_CHANNELS][MAP_CHANNELS]);
#endif
