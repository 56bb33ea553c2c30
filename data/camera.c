#include "data/image.h"
#include "data/noise.h"
#include "data/procedural.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include <math.h>
#include <string.h>

/* Gaussian blur in both directions by a kernel of at most 2 reach + 1 taps; edges repeated. */
static void blur(int size, float sigma, float *image)
{
    enum { REACH = 12 };
    int reach = (int)ceilf(3 * sigma);
    if (reach > REACH) reach = REACH;
    float tap[2 * REACH + 1], total = 0;
    for (int k = -reach; k <= reach; k++) total += tap[k + reach] = expf(-0.5f * (float)(k * k) / (sigma * sigma));
    for (int k = 0; k <= 2 * reach; k++) tap[k] /= total;
    float *work = ts_scratch(TS_SCRATCH_SLOTS - 1, (size_t)size * (size_t)size * 3 * sizeof *work);
    for (int pass = 0; pass < 2; pass++) { /* along rows, writing the transpose; twice */
        for (int y = 0; y < size; y++)
            for (int x = 0; x < size; x++)
                for (int k = 0; k < 3; k++) {
                    float sum = 0;
                    for (int t = -reach; t <= reach; t++) {
                        int at = x + t < 0 ? 0 : x + t >= size ? size - 1 : x + t;
                        sum += tap[t + reach] * image[((size_t)y * (size_t)size + (size_t)at) * 3 + (size_t)k];
                    }
                    work[((size_t)x * (size_t)size + (size_t)y) * 3 + (size_t)k] = sum;
                }
        memcpy(image, work, (size_t)size * (size_t)size * 3 * sizeof *work);
    }
}

void io_camera_apply(const io_camera *c, uint64_t seed, uint64_t index, int size, float *image)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_CAMERA, index);
    float sigma = c->blur * ts_rng_uniform(&rng) * (float)size / 256;
    float strength = c->noise * ts_rng_uniform(&rng);
    if (sigma > 0.15f) blur(size, sigma, image); /* a narrower one changes nothing that 8 bits show */
    /* Variance read^2 + gain * signal (Foi et al., "Practical Poissonian-Gaussian Noise Modeling and Fitting for Single-Image Raw-Data", 2008). */
    float read = 0.01f * strength, gain = 0.002f * strength;
    size_t count = (size_t)size * (size_t)size * 3;
    for (size_t i = 0; i < count; i++) {
        float v = nz_clamp(image[i], 0, 1);
        if (strength > 0) v += sqrtf(read * read + gain * v) * ts_rng_normal(&rng);
        v = nz_clamp(v, 0, 1);
        if (c->quantise) v = io_srgb_to_linear(floorf(io_linear_to_srgb(v) * 255 + 0.5f) / 255);
        image[i] = v;
    }
}
