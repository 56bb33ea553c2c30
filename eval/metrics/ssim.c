#include "eval/metrics/ssim.h"
#include "eval/metrics/filter.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { RADIUS = 5, MOMENTS = 5 };

static double channel(int h, int w, double *moment[MOMENTS])
{
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    double sum = 0;
    for (int y = RADIUS; y < h - RADIUS; y++) {
        double row = 0;
        for (int64_t i = (int64_t)y * w + RADIUS; i < (int64_t)(y + 1) * w - RADIUS; i++) {
            const double ma = moment[0][i], mb = moment[1][i];
            const double va = moment[2][i] - ma * ma, vb = moment[3][i] - mb * mb, cov = moment[4][i] - ma * mb;
            row += (2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
        sum += row;
    }
    return sum;
}

double ev_ssim(int h, int w, const float *a, const float *b)
{
    if (h < EV_SSIM_SIDE || w < EV_SSIM_SIDE) return NAN;
    const ev_taps window = ev_gauss_taps(1.5, RADIUS);
    const size_t pixels = (size_t)h * (size_t)w;
    double *memory = malloc((MOMENTS + 1) * pixels * sizeof *memory), *moment[MOMENTS], sum = 0;
    if (!memory) return NAN;
    for (int k = 0; k < MOMENTS; k++) moment[k] = memory + (size_t)k * pixels;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < pixels; i++) {
            const double x = (double)a[3 * i + (size_t)c], y = (double)b[3 * i + (size_t)c];
            moment[0][i] = x, moment[1][i] = y, moment[2][i] = x * x, moment[3][i] = y * y, moment[4][i] = x * y;
        }
        for (int k = 0; k < MOMENTS; k++)
            ev_filter(h, w, moment[k], &window, &window, memory + MOMENTS * pixels, moment[k]);
        sum += channel(h, w, moment);
    }
    free(memory);
    return sum / (3.0 * (h - 2 * RADIUS) * (w - 2 * RADIUS));
}
