/* Photographs as the method has them. */
#ifndef NN_CLIP_H
#define NN_CLIP_H
#include "tensor/tensor.h"

/* to = from in [0, 1], black where it is not finite. Serial. */
void nn_clip(int64_t count, const float *from, float *to);
/* Whether nn_clip would change nothing, so that a large photograph need not be there twice. */
bool nn_clipped(int64_t count, const float *from, int threads);

/* small [count, size, size, 3] = count photographs [side, side, 3], each as nn_clip makes it, then resampled as
 * ts_resize does where side is not size. arena: for what it holds meanwhile, a copy of one photograph that is not
 * clipped. TS_NOMEM with st. */
ts_code nn_clip_to(const float *const *image, int side, const ts_tensor *small, ts_arena *arena, int threads,
                   ts_status *st);

/* The largest of a pixel's three values and 0; of what is no number nothing. */
static inline float nn_brightest(const float v[3])
{
    const float a = v[0] > 0 ? v[0] : 0, b = v[1] > a ? v[1] : a;
    return v[2] > b ? v[2] : b;
}
#endif
