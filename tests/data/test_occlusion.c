/* Ambient occlusion of reliefs. */
#include "data/occlusion.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A plane sees all of its sky, however it lies (to what eight slices leave out); the middle of a trench what its width
 * over its depth says. */
TEST(occlusion_of_known_reliefs)
{
    enum { N = 256 };
    static float height[N * N], occlusion[N * N];
    for (int i = 0; i < N * N; i++) height[i] = 0.4f * (float)(i % N) / N - 0.3f * (float)(i / N) / N;
    io_occlusion(N, height, false, occlusion, 0);
    for (int i = 0; i < N * N; i++) CHECK(occlusion[i] > 0.997f, "pixel %d of a plane: %g", i, (double)occlusion[i]);
    const float depth = 0.02f;
    const int width = 9;
    for (int i = 0; i < N * N; i++) height[i] = abs(i % N - N / 2) <= width / 2 ? 0 : depth;
    io_occlusion(N, height, true, occlusion, 0);
    const double half = (width / 2 + 1.0) / N, want = half / hypot(half, (double)depth);
    for (int i = 0; i < N; i++) {
        const double got = (double)occlusion[i * N + N / 2];
        CHECK(fabs(got - want) < 0.05, "the middle of a trench sees %g of %g", got, want);
        CHECK(occlusion[i * N] > 0.999f, "far beside it %g", (double)occlusion[i * N]);
    }
}

enum { W = 101, SLICES = 8 };
#define PI 3.14159265358979323846

/* Where the maps repeat, or false beyond the border. */
static bool height_at(const float *height, bool repeats, int i, int j, double *z)
{
    if (repeats) i = (i + 8 * W) % W, j = (j + 8 * W) % W;
    if (i < 0 || j < 0 || i >= W || j >= W) return false;
    *z = (double)height[i * W + j];
    return true;
}

static double slope(const float *height, bool repeats, int i, int j, int di, int dj)
{
    double before = 0, after = 0;
    int width = 2;
    if (!height_at(height, repeats, i - di, j - dj, &before)) height_at(height, repeats, i, j, &before), width--;
    if (!height_at(height, repeats, i + di, j + dj, &after)) height_at(height, repeats, i, j, &after), width--;
    return (after - before) * W / width;
}

/* The angle from above to the horizon in a direction, of a surface that rises by tangent in it. */
static double horizon(const float *height, bool repeats, int i, int j, double dx, double dy, double tangent)
{
    double here = 0, other;
    height_at(height, repeats, i, j, &here);
    for (float t = 1; t <= IO_OCCLUSION_REACH * W; t = fmaxf(t + 1, t * 1.2f)) {
        const int x = (int)lround((double)t * dx), y = (int)lround((double)t * dy);
        if (height_at(height, repeats, i + y, j + x, &other)) tangent = fmax(tangent, (other - here) * W / hypot(x, y));
    }
    return PI / 2 - atan(tangent);
}

static double part(double h, double g) { return (-cos(2 * h - g) + cos(g) + 2 * h * sin(g)) / 4; }

/* The definition, pixel by pixel. */
static double occlusion_at(const float *height, bool repeats, int i, int j)
{
    const double p = slope(height, repeats, i, j, 0, 1), q = slope(height, repeats, i, j, 1, 0);
    double sum = 0;
    for (int k = 0; k < SLICES; k++) {
        const double phi = PI * (k + 0.5) / SLICES, dx = cos(phi), dy = sin(phi), rises = p * dx + q * dy,
                     g = atan(-rises);
        sum += sqrt((1 + rises * rises) / (1 + p * p + q * q)) *
            (part(horizon(height, repeats, i, j, dx, dy, rises), g) +
             part(-horizon(height, repeats, i, j, -dx, -dy, -rises), g));
    }
    return fmin(fmax(sum / SLICES, 0), 1);
}

TEST(occlusion_equals_its_definition)
{
    static float height[W * W], occlusion[2][W * W];
    ts_rng rng = ts_rng_make(71, TS_STREAM_TEST, 0);
    for (int round = 0; round < 6; round++) {
        const bool repeats = round % 2;
        for (int i = 0; i < W * W; i++) height[i] = 0.004f * (float)(1 + round * round) * ts_rng_normal(&rng);
        io_occlusion(W, height, repeats, occlusion[0], 1);
        io_occlusion(W, height, repeats, occlusion[1], 3);
        CHECK(!memcmp(occlusion[0], occlusion[1], sizeof occlusion[0]), "the number of threads changes it");
        for (int i = 0; i < W * W; i++) {
            const double want = occlusion_at(height, repeats, i / W, i % W);
            CHECK(fabs((double)occlusion[0][i] - want) < 2e-5, "round %d, pixel %d, %d: %g, not %g", round, i % W,
                  i / W, (double)occlusion[0][i], want);
        }
    }
    static const float one[1] = {3};
    float alone[1] = {0};
    for (int repeats = 0; repeats < 2; repeats++) {
        io_occlusion(1, one, repeats, alone, 0);
        CHECK(fabsf(alone[0] - 1) < 1e-6f, "one pixel: %g", (double)alone[0]);
    }
}
