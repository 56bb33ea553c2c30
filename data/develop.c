#include "data/develop.h"
#include "data/image/image.h"
#include "data/materials/noise.h"
#include "tensor/scratch.h"
#include <math.h>
#include <pthread.h>
#include <string.h>

float io_tone_curve(const io_tone *t, float v) { return v + v * (1 - v) * (t->bend + t->contrast * (v - t->pivot)); }

static inline float shoulder(float knee, float part, float v)
{
    const float above = nz_clamp((v - knee) * part, 0, 1), left = 1 - above;
    return v < knee ? v : 1 - (1 - knee) * left * left * left;
}

/* t / 3 of the equation, as a factor of v - knee. */
static float third(float knee) { return knee < 1 ? 1 / (3 * (1 - knee)) : 1; }

float io_tone_shoulder(const io_tone *t, float v) { return shoulder(t->knee, third(t->knee), v); }

void io_tone_roll_off(const io_tone *t, size_t count, float *image)
{
    const float knee = t->knee, part = third(knee);
    for (size_t i = 0; i < count; i++) image[i] = shoulder(knee, part, image[i]);
}

/* The sRGB curve at k / STEPS, between which it is taken as straight: 2e-5 at most from the curve. */
enum { STEPS = 4096 };
static float encoded[STEPS + 1];

static void make_encoded(void)
{
    for (int k = 0; k <= STEPS; k++) encoded[k] = io_linear_to_srgb((float)k / STEPS);
}

void io_tone_encode(const io_tone *t, size_t count, float *image)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    float curve[STEPS + 2];
    pthread_once(&once, make_encoded);
    for (int k = 0; k <= STEPS; k++) curve[k] = io_tone_curve(t, encoded[k]);
    curve[STEPS + 1] = curve[STEPS];
    for (size_t i = 0; i < count; i++) {
        const float v = nz_clamp(image[i], 0, 1) * STEPS;
        const int k = (int)v;
        image[i] = curve[k] + (v - (float)k) * (curve[k + 1] - curve[k]);
    }
}

void io_blur(int size, int channels, float sigma, float *image)
{
    enum { REACH = 192 }; /* of sigma 8 at 256 pixels, at 2048 */
    int reach = (int)ceilf(3 * sigma);
    if (reach > REACH) reach = REACH;
    float tap[2 * REACH + 1], total = 0;
    for (int k = -reach; k <= reach; k++) total += tap[k + reach] = expf(-0.5f * (float)(k * k) / (sigma * sigma));
    for (int k = 0; k <= 2 * reach; k++) tap[k] /= total;
    const size_t row = (size_t)size * (size_t)channels;
    const size_t values = (size_t)size * row + row + 2 * (size_t)(reach * channels);
    float *work = ts_scratch(TS_SCRATCH_SLOTS - 1, values * sizeof *work);
    float *padded = work + (size_t)size * row;
    for (int y = 0; y < size; y++) { /* along rows */
        const float *in = image + (size_t)y * row;
        float *out = work + (size_t)y * row;
        memcpy(padded + channels * reach, in, row * sizeof *in);
        for (int t = 0; t < channels * reach; t++) {
            padded[t] = in[t % channels];
            padded[(size_t)(channels * reach + t) + row] = in[row - (size_t)channels + (size_t)(t % channels)];
        }
        memset(out, 0, row * sizeof *out);
        for (int t = 0; t <= 2 * reach; t++)
            for (size_t i = 0; i < row; i++) out[i] += tap[t] * padded[i + (size_t)(channels * t)];
    }
    memset(image, 0, (size_t)size * row * sizeof *image);
    for (int y = 0; y < size; y++) /* down columns */
        for (int t = -reach; t <= reach; t++) {
            const int at = y + t < 0 ? 0 : y + t >= size ? size - 1 : y + t;
            const float *in = work + (size_t)at * row;
            float *out = image + (size_t)y * row;
            for (size_t i = 0; i < row; i++) out[i] += tap[t + reach] * in[i];
        }
}

void io_sharpen(int size, float amount, float sigma, float *image)
{
    const size_t pixels = (size_t)size * (size_t)size;
    float *luma = ts_scratch(TS_SCRATCH_SLOTS - 2, 2 * pixels * sizeof *luma), *blurred = luma + pixels;
    for (size_t i = 0; i < pixels; i++)
        luma[i] = 0.299f * image[3 * i] + 0.587f * image[3 * i + 1] + 0.114f * image[3 * i + 2];
    memcpy(blurred, luma, pixels * sizeof *luma);
    io_blur(size, 1, sigma, blurred);
    for (size_t i = 0; i < pixels; i++) {
        const float more = amount * (luma[i] - blurred[i]);
        for (size_t k = 0; k < 3; k++) image[3 * i + k] = nz_clamp(image[3 * i + k] + more, 0, 1);
    }
}
