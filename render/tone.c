#include "render/tone.h"
#include "render/kernels/shade.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/threads.h"
#include <math.h>

void rd_log_encode(int64_t count, const float *in, float *out, int threads)
{
    double range = log(1.01) - log(0.01);
    float a = (float)(2 / range), b = (float)(-2 * log(0.01) / range - 1);
    enum { CHUNK = 16384 };
    int64_t chunks = (count + CHUNK - 1) / CHUNK;
#pragma omp parallel for num_threads(ts_threads_of(threads)) schedule(static) if (chunks > 1)
    for (int64_t i = 0; i < chunks; i++) {
        int64_t first = i * CHUNK, n = count - first < CHUNK ? count - first : CHUNK;
        ts_shade_k()->log_encode((int)n, in + first, a, b, out + first);
    }
}

float rd_gamma(float v) { return v > 0 ? v < 1 ? powf(v, 1 / 2.2f) : 1 : 0; }

void rd_gamma_encode(int64_t count, const float *in, float *out)
{
    enum { CHUNK = 16384 };
    const int64_t chunks = (count + CHUNK - 1) / CHUNK;
#pragma omp parallel for num_threads(ts_threads()) schedule(static) if (chunks > 1)
    for (int64_t i = 0; i < chunks; i++) {
        const int64_t first = i * CHUNK, n = count - first < CHUNK ? count - first : CHUNK;
        ts_vmath_arrays_k()->gamma(n, in + first, out + first);
    }
}
