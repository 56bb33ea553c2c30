#include "eval/metrics/bands.h"
#include "tensor/maps.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>

const int ev_band[EV_BANDS + 1] = {2, 8, 32, 64, 128};

typedef double _Complex complex_t;

static int smallest_factor(int n)
{
    for (int p = 2; p * p <= n; p++)
        if (n % p == 0) return p;
    return n;
}

/* out[k] = sum_j in[j stride] root[j k step], n step the number of roots. scratch: the number of roots. */
static void transform(int n, const complex_t *in, size_t stride, complex_t *out, const complex_t *root, int step,
                      complex_t *scratch)
{
    if (n == 1) {
        *out = *in;
        return;
    }
    const int p = smallest_factor(n), m = n / p;
    for (int q = 0; q < p; q++)
        transform(m, in + (size_t)q * stride, stride * (size_t)p, out + (size_t)q * (size_t)m, root, step * p, scratch);
    for (int k = 0; k < m; k++) {
        for (int q = 0; q < p; q++) scratch[q] = out[q * m + k];
        for (int j = 0; j < p; j++) {
            complex_t sum = 0;
            for (int q = 0; q < p; q++) sum += scratch[q] * root[(int64_t)q * (k + (int64_t)j * m) % n * step];
            out[j * m + k] = sum;
        }
    }
}

/* Rows, then columns, in place; line: space for two lines. */
static void transform_plane(int size, complex_t *plane, const complex_t *root, complex_t *line)
{
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < size; i++) {
            complex_t *from = pass ? plane + i : plane + (size_t)i * (size_t)size;
            const size_t stride = pass ? (size_t)size : 1;
            transform(size, from, stride, line, root, 1, line + size);
            for (int k = 0; k < size; k++) from[(size_t)k * stride] = line[k];
        }
}

/* n_x + i n_y: the sum over a band's frequencies, which come in pairs of opposite ones, has no products of n_x with
 * n_y. */
static void load(int size, const float *maps, int channels, complex_t *plane)
{
    for (int64_t i = 0; i < (int64_t)size * size; i++) {
        const float *n = maps + i * channels + MAP_NORMAL;
        plane[i] = fmax(-1, fmin(1, (double)n[0])) + I * fmax(-1, fmin(1, (double)n[1]));
    }
}

bool ev_band_correlation(int size, const float *maps, int channels, const float *truth, int truth_channels,
                         double correlation[EV_BANDS])
{
    const double rounding = 1e-6, relief = EV_LEAST_RELIEF; /* RMS; rounding: what floats leave in a band */
    const size_t pixels = (size_t)size * (size_t)size;
    double products[EV_BANDS] = {0}, mine[EV_BANDS] = {0}, theirs[EV_BANDS] = {0};
    complex_t *memory = malloc((2 * pixels + 3 * (size_t)size) * sizeof *memory);
    for (int k = 0; k < EV_BANDS; k++) correlation[k] = NAN;
    if (!memory || size < 1) {
        free(memory);
        return false;
    }
    complex_t *a = memory, *b = memory + pixels, *root = b + pixels, *line = root + size;
    for (int i = 0; i < size; i++) root[i] = cexp(-2 * I * 3.14159265358979323846 * i / size);
    load(size, maps, channels, a);
    load(size, truth, truth_channels, b);
    transform_plane(size, a, root, line);
    transform_plane(size, b, root, line);
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const double f = hypot(x < size - x ? x : size - x, y < size - y ? y : size - y);
            const size_t i = (size_t)y * (size_t)size + (size_t)x;
            for (int k = 0; k < EV_BANDS; k++) {
                if (f < ev_band[k] || f >= ev_band[k + 1]) continue;
                products[k] += creal(conj(a[i]) * b[i]);
                mine[k] += creal(conj(a[i]) * a[i]);
                theirs[k] += creal(conj(b[i]) * b[i]);
            }
        }
    const double square = (double)pixels * (double)pixels;
    for (int k = 0; k < EV_BANDS; k++)
        if (theirs[k] > relief * relief * square)
            correlation[k] = mine[k] > rounding * rounding * square ? products[k] / sqrt(mine[k] * theirs[k]) : 0;
    free(memory);
    return true;
}
