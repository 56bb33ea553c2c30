#include "render/tone.h"
#include "render/kernels/shade.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/team.h"
#include <math.h>

enum { CHUNK = 1 << 14 };

typedef struct encoding {
    const float *in;
    float a, b, *out;
} encoding;

static void log_range(const void *job, int64_t begin, int64_t end)
{
    const encoding *e = job;
    for (int64_t i = begin; i < end; i += CHUNK)
        ts_shade_k()->log_encode((int)(end - i < CHUNK ? end - i : CHUNK), e->in + i, e->a, e->b, e->out + i);
}

static void gamma_range(const void *job, int64_t begin, int64_t end)
{
    const encoding *e = job;
    ts_vmath_arrays_k()->gamma(end - begin, e->in + begin, e->out + begin);
}

void rd_log_encode(int64_t count, const float *in, float *out, int threads)
{
    double range = log(1.01) - log(0.01);
    float a = (float)(2 / range), b = (float)(-2 * log(0.01) / range - 1);
    ts_for(threads, count, CHUNK, log_range, &(encoding){in, a, b, out});
}

float rd_gamma(float v) { return v > 0 ? v < 1 ? powf(v, 1 / 2.2f) : 1 : 0; }

void rd_gamma_encode(int64_t count, const float *in, float *out)
{
    ts_for(0, count, CHUNK, gamma_range, &(encoding){.in = in, .out = out});
}
