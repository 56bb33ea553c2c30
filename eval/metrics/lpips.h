/* LPIPS, version 0.1 with AlexNet: a learned distance of two pictures (Zhang, Isola, Efros, Shechtman, Wang, "The
 * Unreasonable Effectiveness of Deep Features as a Perceptual Metric", 2018, equation 1). The weights are other
 * people's and come from files. */
#ifndef EV_LPIPS_H
#define EV_LPIPS_H
#include "tensor/status.h"

enum { EV_LPIPS_TAPS = 5, EV_LPIPS_SIDE = 31 /* of the smallest picture that reaches the last tap */ };
typedef struct ev_lpips ev_lpips;

/* trunk: torchvision's AlexNet (features.0.weight, features.0.bias, features.3 …, 6, 8, 10; the classifier is left
 * alone). linear: the heads of the lpips package (lin0.model.1.weight … lin4, [1, C, 1, 1]). Each safetensors or
 * PyTorch. NULL and st on failure; the caller frees. */
ev_lpips *ev_lpips_load(const char *trunk, const char *linear, ts_status *st);
void ev_lpips_free(ev_lpips **net);

/* a, b: [h, w, 3] in [0, 1], encoded as they are shown (gamma). With x = 2a - 1, (x - shift)/scale goes through the
 * trunk; F_l are its five ReLUs' outputs, each pixel's divided by (its norm over the channels + 1e-10): sum_l
 * mean_pixels sum_c w_lc (F_lc(a) - F_lc(b))^2 tap (may be NULL): the five terms. NaN where a side is shorter than
 * EV_LPIPS_SIDE or memory cannot be had. Threaded; the same bytes for any number of threads. net keeps working memory:
 * one call at a time. */
double ev_lpips_distance(ev_lpips *net, int h, int w, const float *a, const float *b, double tap[EV_LPIPS_TAPS]);
#endif
