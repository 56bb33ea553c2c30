/* What a phone makes of what its sensor saw: highlights that roll off, a tone curve, sharpening. */
#ifndef IO_DEVELOP_H
#define IO_DEVELOP_H
#include <stddef.h>

/* y = v + v (1 - v) (bend + contrast (v - pivot)) of the sRGB-encoded value v: 0 and 1 stay, and y rises for contrast
 * -0.25 .. 1.2, pivot 0.4 .. 0.6 and |bend| <= 0.25. */
typedef struct io_tone {
    float contrast; /* > 0: an S, steeper in the middle */
    float pivot;    /* lower: the shadows are deepened less and the highlights raised more */
    float bend;     /* > 0: brighter in the middle */
    float knee;     /* linear light above which highlights roll off toward 1; 1: they clip */
} io_tone;

float io_tone_curve(const io_tone *t, float v);

/* Linear light >= 0 to [0, 1]: y = v below the knee k; above it y = 1 - (1 - k) (1 - t / 3)^3, t = (v - k) / (1 - k),
 * with the same slope at k, and 1 from t = 3 on. Public for its test. */
float io_tone_shoulder(const io_tone *t, float v);

/* Both for count values in place: the shoulder of linear light, and linear light in [0, 1] to encoded values. */
void io_tone_roll_off(const io_tone *t, size_t count, float *image);
void io_tone_encode(const io_tone *t, size_t count, float *image);

/* image [size][size][channels] in place: Gaussian blur, sigma in pixels, cut off at 3 sigma or 192 pixels; edges
 * repeated. */
void io_blur(int size, int channels, float sigma, float *image);

/* Unsharp mask of encoded values [size][size][3] in place: each gets amount times the difference of its pixel's luma
 * from the blurred luma; the result lies in [0, 1]. */
void io_sharpen(int size, float amount, float sigma, float *image);
#endif
