/* The losses of baseline JPEG: colour transform, chroma at half the resolution, 8x8 cosine transform,
 * quantisation, and back. The entropy coder loses nothing and is left out. A library would write and read a file for
 * every photograph, and its bytes depend on its build. */
#include "data/camera.h"
#include "data/materials/noise.h"
#include "tensor/scratch.h"
#include <math.h>
#include <pthread.h>
#include <stddef.h>

/* ITU-T T.81, tables K.1 and K.2 */
static const uint8_t luminance[64] = {16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
                                      14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
                                      18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
                                      49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
static const uint8_t chrominance[64] = {17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99,
                                        24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99, 99, 99, 99, 99,
                                        99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
                                        99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99};

static float cosine[64], transposed[64]; /* the orthonormal DCT-II, [frequency][sample] and [sample][frequency] */

static void make_cosine(void)
{
    for (int u = 0; u < 8; u++)
        for (int x = 0; x < 8; x++) {
            const double v = (u ? 0.5 : sqrt(0.125)) * cos((2 * x + 1) * u * 0.19634954084936207);
            cosine[u * 8 + x] = transposed[x * 8 + u] = (float)v;
        }
}

typedef float lanes __attribute__((vector_size(16), aligned(4), may_alias));

/* out = a b, 8 x 8; b in registers. */
static inline void multiply(const float *a, const float *b, float *out)
{
    lanes left[8], right[8];
    for (int k = 0; k < 8; k++) {
        left[k] = *(const lanes *)(b + 8 * k);
        right[k] = *(const lanes *)(b + 8 * k + 4);
    }
    for (int i = 0; i < 8; i++) {
        lanes p = {0}, q = {0};
        for (int k = 0; k < 8; k++) {
            const float s = a[i * 8 + k];
            p += s * left[k];
            q += s * right[k];
        }
        *(lanes *)(out + 8 * i) = p;
        *(lanes *)(out + 8 * i + 4) = q;
    }
}

/* Every 8x8 block of a plane whose sides are multiples of 8. */
static void quantise(int width, int height, const float step[64], float *plane)
{
    float inverse[64], block[64], work[64];
    for (int i = 0; i < 64; i++) inverse[i] = 1 / step[i];
    for (int y = 0; y < height; y += 8)
        for (int x = 0; x < width; x += 8) {
            float *p = plane + (size_t)y * (size_t)width + (size_t)x;
            for (int i = 0; i < 8; i++)
                for (int j = 0; j < 8; j++) block[i * 8 + j] = p[(size_t)i * (size_t)width + (size_t)j] - 128;
            multiply(cosine, block, work);
            multiply(work, transposed, block);
            for (int i = 0; i < 64; i++) block[i] = nz_floor(block[i] * inverse[i] + 0.5f) * step[i];
            multiply(transposed, block, work);
            multiply(work, cosine, block);
            for (int i = 0; i < 8; i++)
                for (int j = 0; j < 8; j++)
                    p[(size_t)i * (size_t)width + (size_t)j] = nz_clamp(block[i * 8 + j] + 128, 0, 255);
        }
}

static void steps(const uint8_t table[64], int quality, float step[64])
{
    const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
    for (int i = 0; i < 64; i++) {
        const int v = (table[i] * scale + 50) / 100;
        step[i] = (float)(v < 1 ? 1 : v > 255 ? 255 : v);
    }
}

/* A plane of side x side in rows of stride values, of which the padding repeats the last column and row. */
static void pad(int side, int stride, float *p)
{
    for (int y = 0; y < side; y++)
        for (int x = side; x < stride; x++)
            p[(size_t)y * (size_t)stride + (size_t)x] = p[(size_t)y * (size_t)stride + (size_t)side - 1];
    for (int y = side; y < stride; y++)
        for (int x = 0; x < stride; x++)
            p[(size_t)y * (size_t)stride + (size_t)x] = p[(size_t)(side - 1) * (size_t)stride + (size_t)x];
}

/* Means of 2 x 2 pixels; the last ones again where the side is odd. */
static void halve(int side, int stride, const float *in, int half_stride, float *out)
{
    for (int y = 0; y < (side + 1) / 2; y++)
        for (int x = 0; x < (side + 1) / 2; x++) {
            const int right = 2 * x + 1 < side ? 2 * x + 1 : 2 * x, below = 2 * y + 1 < side ? 2 * y + 1 : 2 * y;
            const float *a = in + (size_t)(2 * y) * (size_t)stride, *b = in + (size_t)below * (size_t)stride;
            out[(size_t)y * (size_t)half_stride + (size_t)x] = 0.25f * (a[2 * x] + a[right] + b[2 * x] + b[right]);
        }
}

/* Back: each pixel 9/16 of its own value, 3/16 of the two beside it and 1/16 of the one across, as common decoders
 * interpolate. */
static void twice(int side, int half_stride, const float *in, int stride, float *out)
{
    const int last = (side + 1) / 2 - 1;
    for (int y = 0; y < side; y++) {
        const int own = y / 2, other = y % 2 ? (own < last ? own + 1 : own) : (own > 0 ? own - 1 : own);
        const float *a = in + (size_t)own * (size_t)half_stride, *b = in + (size_t)other * (size_t)half_stride;
        for (int x = 0; x < side; x++) {
            const int at = x / 2, next = x % 2 ? (at < last ? at + 1 : at) : (at > 0 ? at - 1 : at);
            out[(size_t)y * (size_t)stride + (size_t)x] = 0.5625f * a[at] + 0.1875f * (a[next] + b[at]) +
                0.0625f * b[next];
        }
    }
}

void io_jpeg_codes(int size, int quality, bool halved, uint8_t *codes)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_cosine);
    const int stride = (size + 7) / 8 * 8, half = (size + 1) / 2, half_stride = (half + 7) / 8 * 8;
    const size_t area = (size_t)stride * (size_t)stride;
    float *plane[3] = {
        ts_scratch(TS_SCRATCH_SLOTS - 2, (3 * area + (size_t)half_stride * (size_t)half_stride) * sizeof(float))};
    plane[1] = plane[0] + area;
    plane[2] = plane[1] + area;
    float *small = plane[2] + area, step[64];
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const uint8_t *p = codes + ((size_t)y * (size_t)size + (size_t)x) * 3;
            const float r = p[0], g = p[1], b = p[2];
            const size_t i = (size_t)y * (size_t)stride + (size_t)x;
            /* ITU-T T.871, rounded to 8 bits as in a file */
            plane[0][i] = nz_floor(0.299f * r + 0.587f * g + 0.114f * b + 0.5f);
            plane[1][i] = nz_clamp(nz_floor(-0.168736f * r - 0.331264f * g + 0.5f * b + 128.5f), 0, 255);
            plane[2][i] = nz_clamp(nz_floor(0.5f * r - 0.418688f * g - 0.081312f * b + 128.5f), 0, 255);
        }
    for (int k = 0; k < 3; k++) {
        steps(k ? chrominance : luminance, quality, step);
        if (k && halved) {
            halve(size, stride, plane[k], half_stride, small);
            pad(half, half_stride, small);
            quantise(half_stride, half_stride, step, small);
            twice(size, half_stride, small, stride, plane[k]);
        } else {
            pad(size, stride, plane[k]);
            quantise(stride, stride, step, plane[k]);
        }
    }
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const size_t i = (size_t)y * (size_t)stride + (size_t)x;
            const float l = plane[0][i], cb = plane[1][i] - 128, cr = plane[2][i] - 128;
            const float rgb[3] = {l + 1.402f * cr, l - 0.344136f * cb - 0.714136f * cr, l + 1.772f * cb};
            for (int k = 0; k < 3; k++)
                codes[((size_t)y * (size_t)size + (size_t)x) * 3 + (size_t)k] = (uint8_t)nz_clamp(rgb[k] + 0.5f, 0,
                                                                                                  255);
        }
}
