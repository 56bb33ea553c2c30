/* Structural similarity. */
#ifndef EV_SSIM_H
#define EV_SSIM_H
/* Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004,
 * equation 13: (2 ma mb + C1) (2 sab + C2) / ((ma^2 + mb^2 + C1) (sa + sb + C2)),  C1 = 0.01^2, C2 = 0.03^2, with
 * means, variances and covariance under an 11 x 11 Gaussian window of sigma 1.5 that sums to 1, for values in [0, 1].
 * The mean over the windows that lie wholly inside the picture (the border of 5 pixels is not a centre), of red, green
 * and blue alike. a, b: [h, w, 3]. NaN where the picture is smaller than the window, or memory for it cannot be had. */
enum { EV_SSIM_SIDE = 11 };
double ev_ssim(int h, int w, const float *a, const float *b);
#endif
