/* Separable filters of one-channel pictures, for the measures that compare neighbourhoods. */
#ifndef EV_FILTER_H
#define EV_FILTER_H

enum { EV_TAPS_MAX = 64 };

/* 2 radius + 1 weights; tap[radius] is the centre's. */
typedef struct ev_taps {
    int radius;
    double tap[2 * EV_TAPS_MAX + 1];
} ev_taps;

/* exp(-x^2 / (2 sigma^2)) at whole x, scaled to a sum of 1. radius <= EV_TAPS_MAX. */
ev_taps ev_gauss_taps(double sigma, int radius);

/* out(y, x) = sum_j sum_i down[j] across[i] in(y + j, x + i), the nearest pixel outside. in, out and work are [h, w]
 * and three different memories, but out may be in. Threaded; the same bytes for any number of threads. */
void ev_filter(int h, int w, const double *in, const ev_taps *across, const ev_taps *down, double *work, double *out);
#endif
