/* Photographs as the method has them. */
#ifndef LGD_CLIP_H
#define LGD_CLIP_H
#include <float.h>
#include <stdint.h>

/* to = from in [0, 1], black where it is not finite. */
static inline void lgd_clip(int64_t count, const float *from, float *to)
{
    for (int64_t i = 0; i < count; i++) {
        const float v = from[i];
        to[i] = !(v > 0 && v <= FLT_MAX) ? 0 : v < 1 ? v : 1;
    }
}
#endif
