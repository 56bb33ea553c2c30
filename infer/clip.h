/* Photographs as the method has them. */
#ifndef LGD_CLIP_H
#define LGD_CLIP_H
#include <stdbool.h>
#include <stdint.h>

/* to = from in [0, 1], black where it is not finite. Serial. */
void lgd_clip(int64_t count, const float *from, float *to);
/* Whether lgd_clip would change nothing, so that a large photograph need not be there twice. */
bool lgd_clipped(int64_t count, const float *from, int threads);
#endif
