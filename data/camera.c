#include "data/camera.h"
#include "data/image/image.h"
#include "data/materials/noise.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include <math.h>
#include <pthread.h>
#include <stddef.h>
#include <string.h>

/* Every fault is drawn, whether it is switched on or not, so that one key changes one fault. */
typedef struct faults {
    float exposure, read, shot, vignette, red, blue, tilt, tilt_turn, away, away_turn, jpeg;
    bool halved;
} faults;

static faults draw(uint64_t seed, uint64_t index)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_PHOTOGRAPH, index);
    faults f;
    f.exposure = ts_rng_range(&r, -1, 1);
    f.read = ts_rng_range(&r, -1, 1);
    f.shot = ts_rng_range(&r, -1, 1);
    f.vignette = ts_rng_uniform(&r);
    f.red = ts_rng_range(&r, -1, 1);
    f.blue = ts_rng_range(&r, -1, 1);
    f.tilt = ts_rng_uniform(&r);
    f.tilt_turn = ts_rng_range(&r, 0, 6.2831853f);
    f.away = ts_rng_uniform(&r);
    f.away_turn = ts_rng_range(&r, 0, 6.2831853f);
    f.jpeg = ts_rng_uniform(&r);
    f.halved = ts_rng_uniform(&r) < 0.5f;
    return f;
}

void io_camera_place(const io_camera *c, uint64_t seed, uint64_t index, float distance, float position[3])
{
    const faults f = draw(seed, index);
    const float angle = c->tilt * f.tilt * 0.017453293f, away = c->off_centre * f.away, across = distance * sinf(angle);
    position[0] = away * cosf(f.away_turn) + across * cosf(f.tilt_turn);
    position[1] = away * sinf(f.away_turn) + across * sinf(f.tilt_turn);
    position[2] = distance * cosf(angle);
}

float io_camera_exposure(const io_camera *c, uint64_t seed, uint64_t index)
{
    return c->exposure > 0 ? exp2f(c->exposure * draw(seed, index).exposure) : 1;
}

/* Gaussian blur in both directions by a kernel of at most 2 reach + 1 taps; edges repeated. */
static void blur(int size, float sigma, float *image)
{
    enum { REACH = 12 };
    int reach = (int)ceilf(3 * sigma);
    if (reach > REACH) reach = REACH;
    float tap[2 * REACH + 1], total = 0;
    for (int k = -reach; k <= reach; k++) total += tap[k + reach] = expf(-0.5f * (float)(k * k) / (sigma * sigma));
    for (int k = 0; k <= 2 * reach; k++) tap[k] /= total;
    const size_t row = (size_t)size * 3;
    float *work = ts_scratch(TS_SCRATCH_SLOTS - 1, ((size_t)size * row + row + 6 * REACH) * sizeof *work);
    float *padded = work + (size_t)size * row;
    for (int y = 0; y < size; y++) { /* along rows */
        const float *in = image + (size_t)y * row;
        float *out = work + (size_t)y * row;
        memcpy(padded + 3 * reach, in, row * sizeof *in);
        for (int t = 0; t < 3 * reach; t++) {
            padded[t] = in[t % 3];
            padded[(size_t)(3 * reach + t) + row] = in[row - 3 + (size_t)(t % 3)];
        }
        memset(out, 0, row * sizeof *out);
        for (int t = 0; t <= 2 * reach; t++)
            for (size_t i = 0; i < row; i++) out[i] += tap[t] * padded[i + 3 * (size_t)t];
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

/* The 8-bit codes of io_linear_to_srgb without its powf for every value: guess[] by the linear value's leading 12 bits,
 * where a code spans more than one step, then the exact threshold. */
enum { GUESSES = 4096 };
static float threshold[257], linear[256]; /* threshold[c]: the least value that has code c */
static uint8_t guess[GUESSES + 1];

static int code_of(float v) { return (int)floorf(io_linear_to_srgb(v) * 255 + 0.5f); }

static void make_codes(void)
{
    for (int c = 0; c < 256; c++) {
        uint32_t lo = 0, hi = 0x3f800000; /* the bits of 0 and 1: floats of one sign are in the order of their bits */
        while (lo < hi) {
            const uint32_t middle = lo + (hi - lo) / 2;
            float v;
            memcpy(&v, &middle, sizeof v);
            if (code_of(v) >= c) hi = middle;
            else lo = middle + 1;
        }
        memcpy(&threshold[c], &lo, sizeof lo);
        linear[c] = io_srgb_to_linear((float)c / 255);
    }
    threshold[256] = 2;
    for (int k = 0; k <= GUESSES; k++) guess[k] = (uint8_t)code_of((float)k / GUESSES);
}

static inline int srgb_code(float v)
{
    int c = guess[(int)(v * GUESSES)];
    while (v >= threshold[c + 1]) c++;
    return c;
}

static void expose(const io_camera *c, const faults *f, uint64_t seed, uint64_t index, int size, float *image)
{
    const float exposure = io_camera_exposure(c, seed, index), loss = c->vignette * f->vignette;
    const float gain[3] = {exposure * (1 + c->white_balance * f->red), exposure,
                           exposure * (1 + c->white_balance * f->blue)};
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const float px = ((float)x + 0.5f) / (float)size - 0.5f, py = ((float)y + 0.5f) / (float)size - 0.5f;
            const float seen = 1 - loss * 2 * (px * px + py * py); /* the corner is sqrt(1/2) away */
            for (int k = 0; k < 3; k++) image[((size_t)y * (size_t)size + (size_t)x) * 3 + (size_t)k] *= gain[k] * seen;
        }
}

/* Of variance read^2 + gain v, clipped again. */
static void add_noise(ts_rng *rng, float read, float gain, size_t count, float *image)
{
    enum { PART = 1024 };
    float normal[PART];
    for (size_t begin = 0; begin < count; begin += PART, image += PART) {
        const int n = count - begin < PART ? (int)(count - begin) : PART;
        ts_rng_normals(rng, n, normal);
        for (int i = 0; i < n; i++)
            image[i] = nz_clamp(image[i] + __builtin_sqrtf(read * read + gain * image[i]) * normal[i], 0, 1);
    }
}

void io_camera_apply(const io_camera *c, uint64_t seed, uint64_t index, int size, float *image)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    ts_rng rng = ts_rng_make(seed, TS_STREAM_CAMERA, index);
    const faults f = draw(seed, index);
    float sigma = c->blur * ts_rng_uniform(&rng) * (float)size / 256;
    float strength = c->noise * ts_rng_uniform(&rng);
    /* Variance read^2 + gain * signal (Foi et al., "Practical Poissonian-Gaussian Noise Modeling and Fitting for
     * Single-Image Raw-Data", 2008). */
    float read = 0.01f * strength, gain = 0.002f * strength;
    if (c->noise_spread > 0) {
        read *= exp2f(c->noise_spread * f.read);
        gain *= exp2f(c->noise_spread * f.shot);
    }
    size_t count = (size_t)size * (size_t)size * 3;
    if (c->exposure > 0 || c->vignette > 0 || c->white_balance > 0) expose(c, &f, seed, index, size, image);
    for (size_t i = 0; i < count; i++) image[i] = nz_clamp(image[i], 0, 1);
    if (sigma > 0.15f) blur(size, sigma, image); /* a narrower one is invisible in 8 bits */
    if (strength > 0) add_noise(&rng, read, gain, count, image);
    if (!c->quantise && !c->jpeg) return;
    pthread_once(&once, make_codes);
    uint8_t *codes = ts_scratch(TS_SCRATCH_SLOTS - 1, count); /* the blur's: it is done */
    for (size_t i = 0; i < count; i++) codes[i] = (uint8_t)srgb_code(nz_clamp(image[i], 0, 1));
    if (c->jpeg) io_jpeg_codes(size, c->jpeg + (int)(f.jpeg * (float)(99 - c->jpeg)), f.halved, codes);
    for (size_t i = 0; i < count; i++) image[i] = linear[codes[i]];
}
