/* scikit-image's transform.resize smooths by scipy.ndimage.gaussian_filter and then interpolates by scipy.ndimage.zoom
 * with grid_mode; both are linear and separable, so that one list of weights an axis does both. */
#include "data/image/resize_scikit.h"
#include <math.h>
#include <string.h>

/* scipy's mode "mirror", numpy's "reflect": d c b | a b c d | c b a, of integers and of what lies between them. */
static double mirror(double x, int in)
{
    const double last = in - 1, period = 2 * last;
    if (in == 1) return 0;
    x = fmod(fabs(x), period);
    return x > last ? period - x : x;
}

/* Half of a Gaussian that sums to 1 with its other half: weight[0 .. radius]. */
static void gaussian(double sigma, int radius, double *weight)
{
    double sum = 1;
    weight[0] = 1;
    for (int i = 1; i <= radius; i++) {
        weight[i] = exp(-0.5 * i * i / (sigma * sigma));
        sum += 2 * weight[i];
    }
    for (int i = 0; i <= radius; i++) weight[i] /= sum;
}

ts_taps io_taps_scikit(ts_arena *arena, int in, int out)
{
    const double factor = (double)in / out, sigma = fmax(0, (factor - 1) / 2);
    const int radius = (int)(4 * sigma + 0.5), most = 2 * radius + 2 < in ? 2 * radius + 2 : in;
    ts_taps t = {.in = in, .out = out};
    t.first = ts_arena_alloc(arena, (size_t)out * sizeof *t.first);
    t.offset = ts_arena_alloc(arena, ((size_t)out + 1) * sizeof *t.offset);
    double *half = ts_arena_alloc(arena, ((size_t)radius + 1) * sizeof *half),
           *sum = ts_arena_alloc(arena, (size_t)in * sizeof *sum);
    float *weight = ts_arena_alloc(arena, (size_t)out * (size_t)most * sizeof *weight);
    if (!t.first || !t.offset || !half || !sum || !weight) return t;
    gaussian(sigma, radius, half);
    t.offset[0] = 0;
    for (int j = 0; j < out; j++) {
        const double x = mirror((j + 0.5) * factor - 0.5, in);
        const int low = (int)x < in - 1 ? (int)x : in > 1 ? in - 2 : 0;
        const double share[2] = {1 - (x - low), x - low};
        /* What is mirrored falls on pixels that are read anyway, unless the filter is as wide as the image. */
        int first = low - radius > 0 ? low - radius : 0, last = low + 1 + radius < in - 1 ? low + 1 + radius : in - 1;
        if (radius + 1 >= in) first = 0, last = in - 1;
        memset(sum + first, 0, (size_t)(last - first + 1) * sizeof *sum);
        for (int k = 0; k < 2 && low + k < in; k++)
            for (int i = -radius; i <= radius; i++)
                sum[(int)mirror(low + k + i, in)] += share[k] * half[i < 0 ? -i : i];
        t.first[j] = first;
        t.offset[j + 1] = t.offset[j] + last - first + 1;
        for (int i = first; i <= last; i++) weight[t.offset[j] + i - first] = (float)sum[i];
    }
    t.weight = weight;
    return t;
}
