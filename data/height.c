#include "data/height.h"
#include "tensor/conv/gemm.h"
#include "tensor/memory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_Z 0.05f /* sine of 3 degrees */
#define PI 3.14159265358979323846

/* dz/dx and dz/dy (y down, as rows go) times the pixel's width. */
static void slopes(const io_material *m, float *p, float *q)
{
    const size_t pixels = (size_t)m->size * (size_t)m->size;
    for (size_t i = 0; i < pixels; i++) {
        const io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
        const float z = fmaxf(t.normal[2], LEAST_Z) * (float)m->size;
        p[i] = -t.normal[0] / z;
        q[i] = t.normal[1] / z;
    }
}

/* What the differences of neighbours, each the mean of its two slopes, flow out of every pixel: D^T of them. */
static void divergence(int n, bool repeats, const float *p, const float *q, float *out)
{
    const size_t row = (size_t)n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const size_t at = (size_t)i * row + (size_t)j, line = at - (size_t)j, column = (size_t)j;
            float sum = 0;
            if (j > 0 || repeats) sum += 0.5f * (p[line + (size_t)((j + n - 1) % n)] + p[at]);
            if (j < n - 1 || repeats) sum -= 0.5f * (p[at] + p[line + (size_t)((j + 1) % n)]);
            if (i > 0 || repeats) sum += 0.5f * (q[(size_t)((i + n - 1) % n) * row + column] + q[at]);
            if (i < n - 1 || repeats) sum -= 0.5f * (q[at] + q[(size_t)((i + 1) % n) * row + column]);
            out[at] = sum;
        }
}

/* Each row is an eigenvector of D^T D with the eigenvalue 2 - 2 cos(pi k / n). */
void io_cosines(int n, float *c)
{
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++) {
            const int phase = (int)((int64_t)k * (2 * j + 1) %
                                    (4 * (int64_t)n)); /* exact, where the angle itself would lose digits */
            c[(size_t)k * (size_t)n + (size_t)j] = (float)((k ? sqrt(2.0 / n) : sqrt(1.0 / n)) *
                                                           cos(PI * phase / (2.0 * n)));
        }
}

/* The same where the differences go around: row k is (cos + sin)(2 pi k j / n) / sqrt(n), its own inverse. */
static void hartley(int n, float *c)
{
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++) {
            const double angle = 2 * PI * (double)((int64_t)k * j % n) / n;
            c[(size_t)k * (size_t)n + (size_t)j] = (float)((cos(angle) + sin(angle)) / sqrt(n));
        }
}

/* 4 sin^2(x/2) and not 2 - 2 cos x: the smallest are what heights are made of. */
static double eigenvalue(int k, int n, bool repeats)
{
    const double s = sin(PI * k / (repeats ? 1.0 * n : 2.0 * n));
    return 4 * s * s;
}

ts_code io_height(const io_material *m, bool repeats, float *height, int threads, ts_status *st)
{
    const int n = m->size;
    const size_t pixels = (size_t)n * (size_t)n;
    float *memory = ts_memory(3 * pixels * sizeof *memory);
    if (!memory) return ts_fail(st, TS_NOMEM, "no memory for heights of %d x %d pixels", n, n);
    float *a = memory, *b = a + pixels, *c = b + pixels;
    slopes(m, a, b);
    divergence(n, repeats, a, b, height);
    if (repeats) hartley(n, c);
    else io_cosines(n, c);
    ts_gemm(false, false, n, n, n, 1, c, height, 0, a, threads);
    ts_gemm(false, true, n, n, n, 1, a, c, 0, b, threads);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double e = eigenvalue(i, n, repeats) + eigenvalue(j, n, repeats);
            float *v = b + (size_t)i * (size_t)n + (size_t)j;
            *v = i || j ? (float)((double)*v / e) : 0;
        }
    ts_gemm(true, false, n, n, n, 1, c, b, 0, a, threads);
    ts_gemm(false, false, n, n, n, 1, a, c, 0, height, threads);
    free(memory);
    return TS_OK;
}
