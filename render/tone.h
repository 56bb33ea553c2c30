/* Transforms of linear radiance: the encoding that g reads, and the one that evaluation compares. */
#ifndef RD_TONE_H
#define RD_TONE_H
#include <stdint.h>

/* The encoding for g: out = 2 (log(I + 0.01) - log 0.01) / (log 1.01 - log 0.01) - 1, so that [0, 1] becomes [-1, 1].
 * I is clamped to [0, 1] first, as a photograph is (NaN becomes 0). in may be out. Threaded. */
void rd_log_encode(int64_t count, const float *in, float *out, int threads);

/* The encoding for evaluation: clamp(v, 0, 1)^(1/2.2), as in published figures, not the sRGB curve. NaN becomes 0. */
float rd_gamma(float v);
/* The same of count values, within rounding. in may be out. Threaded. */
void rd_gamma_encode(int64_t count, const float *in, float *out);
#endif
