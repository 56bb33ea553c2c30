/* Photographs as the method has them. */
#ifndef NN_CLIP_H
#define NN_CLIP_H
#include <stdbool.h>
#include <stdint.h>

/* to = from in [0, 1], black where it is not finite. Serial. */
void nn_clip(int64_t count, const float *from, float *to);
/* Whether nn_clip would change nothing, so that a large photograph need not be there twice. */
bool nn_clipped(int64_t count, const float *from, int threads);

/* The largest of a pixel's three values. */
static inline float nn_brightest(const float v[3])
{
    const float a = v[0] > v[1] ? v[0] : v[1];
    return a > v[2] ? a : v[2];
}
#endif
