#include "nn/clip.h"
#include "tensor/team.h"
#include <float.h>
#include <stdatomic.h>

void nn_clip(int64_t count, const float *from, float *to)
{
    for (int64_t i = 0; i < count; i++) {
        const float v = from[i];
        to[i] = !(v > 0 && v <= FLT_MAX) ? 0 : v < 1 ? v : 1;
    }
}

typedef struct inspection {
    const float *from;
    atomic_bool *fine;
} inspection;

static void inspect(const void *job, int64_t begin, int64_t end)
{
    const inspection *i = job;
    bool fine = true;
    for (int64_t k = begin; k < end; k++) fine = fine && i->from[k] >= 0 && i->from[k] <= 1;
    if (!fine) atomic_store(i->fine, false);
}

bool nn_clipped(int64_t count, const float *from, int threads)
{
    enum { STEP = 1 << 12 };
    atomic_bool fine = true;
    ts_for(threads, count, STEP, inspect, &(inspection){from, &fine});
    return fine;
}
