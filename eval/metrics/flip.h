/* FLIP, the difference that a viewer sees when he flips between two pictures (Andersson, Nilsson, Akenine-Moller,
 * Oskarsson, Astrom, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020), for pictures in [0, 1] at
 * EV_FLIP_PPD pixels per degree. */
#ifndef EV_FLIP_H
#define EV_FLIP_H
#include "eval/metrics/filter.h"
#include <stdbool.h>

/* A screen 0.7 m wide with 3840 pixels, seen from 0.7 m: 0.7 * 3840 / 0.7 * pi / 180. */
#define EV_FLIP_PPD 67.02064327658226

/* test, reference: [h, w, 3], LINEAR sRGB primaries, clamped to [0, 1] here (NaN: 0). map [h, w] (may be NULL): the
 * error of each pixel in [0, 1]. Returns their mean, NaN when memory cannot be had. Threaded; the same bytes for any
 * number of threads. */
double ev_flip(int h, int w, const float *test, const float *reference, float *map);

/* The steps, each as the paper defines it (section numbers are the paper's). */

/* Linear sRGB to Y Cx Cz (section 4.1.1): 116 Y/Yn - 16, 500 (X/Xn - Y/Yn), 200 (Y/Yn - Z/Zn); and back. The white is
 * (1, 1, 1). */
void ev_flip_ycxcz(const double rgb[3], double ycc[3]);
void ev_flip_rgb(const double ycc[3], double rgb[3]);
/* Linear sRGB to CIE L*a*b*. */
void ev_flip_lab(const double rgb[3], double lab[3]);

/* The contrast sensitivity filters (equation 3, table 1) as sums of separable Gaussians: channel 0 achromatic, 1
 * red-green, 2 blue-yellow. The filter is sum_k weight[k] taps[k](x) taps[k](y) with taps that sum to 1 and weights
 * that sum to 1; returns how many terms. */
int ev_flip_csf(int channel, double weight[2], ev_taps taps[2]);

/* Hunt adjustment: a* and b* times 0.01 L* (section 4.1.2, equation 4). */
void ev_flip_hunt(double lab[3]);
/* |dL| + |(da, db)| (equation 5). */
double ev_flip_hyab(const double a[3], const double b[3]);
/* HyAB^0.7, redistributed so that 0.4 of the largest (pure green against pure blue) becomes 0.95 and the largest 1
 * (equation 6). */
double ev_flip_colour(double hyab, double largest);
/* The HyAB of pure green and pure blue to the power 0.7. */
double ev_flip_largest(void);

/* First (point false: edges) and second derivative of a Gaussian of sigma 0.041 EV_FLIP_PPD pixels, positive weights
 * scaled to a sum of 1 and negative ones to -1 (section 4.2); smooth: the Gaussian that goes across. */
void ev_flip_feature(bool point, ev_taps *derivative, ev_taps *smooth);
#endif
