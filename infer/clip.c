#include "infer/clip.h"
#include "tensor/threads.h"
#include <float.h>

void lgd_clip(int64_t count, const float *from, float *to)
{
    for (int64_t i = 0; i < count; i++) {
        const float v = from[i];
        to[i] = !(v > 0 && v <= FLT_MAX) ? 0 : v < 1 ? v : 1;
    }
}

bool lgd_clipped(int64_t count, const float *from, int threads)
{
    bool fine = true;
#pragma omp parallel for num_threads(ts_threads_of(threads)) schedule(static) reduction(&& : fine)
    for (int64_t i = 0; i < count; i++) fine = fine && from[i] >= 0 && from[i] <= 1;
    return fine;
}
