/* SSIM, FLIP and the angle of normals against their definitions, written here once more and as plainly as possible. */
#include "eval/metrics/flip.h"
#include "eval/metrics/ssim.h"
#include "render/error.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
enum { H = 19, W = 26, N = H * W * 3 };

/* Smooth colours with noise and a hard edge, in [0, 1]. */
static void picture(uint64_t seed, float *p)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++) {
                const double v = 0.5 + 0.4 * sin(0.3 * x + 0.2 * y * (c + 1) + (double)seed) + (x > W / 2 ? 0.2 : 0);
                p[(y * W + x) * 3 + c] = (float)fmin(1, fmax(0, v + 0.1 * (double)ts_rng_range(&r, -1, 1)));
            }
}

static int at(int i, int n) { return i < 0 ? 0 : i >= n ? n - 1 : i; }

static double plain_ssim(const float *a, const float *b)
{
    double total = 0, weight[11][11], sum = 0;
    for (int j = 0; j < 11; j++)
        for (int i = 0; i < 11; i++)
            sum += weight[j][i] = exp(-((j - 5) * (j - 5) + (i - 5) * (i - 5)) / (2 * 1.5 * 1.5));
    int windows = 0;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y + 11 <= H; y++)
            for (int x = 0; x + 11 <= W; x++, windows++) {
                double ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
                for (int pass = 0; pass < 2; pass++)
                    for (int j = 0; j < 11; j++)
                        for (int i = 0; i < 11; i++) {
                            const int k = ((y + j) * W + x + i) * 3 + c;
                            const double w = weight[j][i] / sum, p = (double)a[k], q = (double)b[k];
                            if (!pass) ma += w * p, mb += w * q;
                            else
                                va += w * (p - ma) * (p - ma), vb += w * (q - mb) * (q - mb),
                                    cov += w * (p - ma) * (q - mb);
                        }
                total += (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
            }
    return total / windows;
}

TEST(eval_ssim_is_its_definition)
{
    static float a[N], b[N];
    for (uint64_t s = 1; s < 5; s++) {
        picture(s, a);
        picture(s + 1, b);
        const double got = ev_ssim(H, W, a, b), expected = plain_ssim(a, b);
        CHECK(fabs(got - expected) < 1e-12, "%.15g, not %.15g", got, expected);
        CHECK(ev_ssim(H, W, b, a) == got, "it is not symmetrical");
        CHECK(fabs(ev_ssim(H, W, a, a) - 1) < 1e-12, "a picture is not like itself");
        CHECK(got < 0.9 && got > -1, "%g", got);
    }
    for (int i = 0; i < N; i++) a[i] = 0.25f, b[i] = 0.5f; /* no structure: the luminance term alone */
    CHECK(fabs(ev_ssim(H, W, a, b) - (0.25 + 1e-4) / (0.3125 + 1e-4)) < 1e-9, "two grey pictures: %g",
          ev_ssim(H, W, a, b));
    CHECK(isnan(ev_ssim(10, 30, a, b)) && isnan(ev_ssim(30, 10, a, b)),
          "a picture smaller than the window has an SSIM");
    CHECK(fabs(ev_ssim(11, 11, a, b) - (0.25 + 1e-4) / (0.3125 + 1e-4)) < 1e-9, "a single window");
}

TEST(eval_flip_colours)
{
    static const double rgb[][3] = {
        {1, 1, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2, 0.5, 0.8}, {0.001, 0.002, 0.0005}};
    /* CIE L*a*b* of sRGB's colours under D65, as colour calculators give them. */
    static const double lab[][3] = {{100, 0, 0},
                                    {0, 0, 0},
                                    {53.2408, 80.0925, 67.2032},
                                    {87.7347, -86.1827, 83.1793},
                                    {32.2970, 79.1875, -107.8602}};
    for (size_t i = 0; i < sizeof rgb / sizeof *rgb; i++) {
        double ycc[3], back[3], got[3];
        ev_flip_ycxcz(rgb[i], ycc);
        ev_flip_rgb(ycc, back);
        ev_flip_lab(rgb[i], got);
        for (int c = 0; c < 3; c++) {
            CHECK(fabs(back[c] - rgb[i][c]) < 1e-12, "colour %zu does not come back: %g, not %g", i, back[c],
                  rgb[i][c]);
            CHECK(i >= 5 || fabs(got[c] - lab[i][c]) < 0.02, "colour %zu: Lab %d is %g, not %g", i, c, got[c],
                  lab[i][c]);
        }
        const double y = 0.2126 * rgb[i][0] + 0.7152 * rgb[i][1] + 0.0722 * rgb[i][2];
        CHECK(fabs(ycc[0] - (116 * y - 16)) < 0.02, "Y of colour %zu: %g", i, ycc[0]);
        CHECK(i > 1 || (fabs(ycc[1]) < 1e-10 && fabs(ycc[2]) < 1e-10), "grey has a chroma");
    }
}

TEST(eval_flip_colour_difference)
{
    const double a[3] = {50, 3, 4}, b[3] = {20, 6, 8}, largest = ev_flip_largest();
    double hunt[3] = {50, 30, -40};
    ev_flip_hunt(hunt);
    CHECK(hunt[0] == 50 && hunt[1] == 15 && hunt[2] == -20, "Hunt: %g %g %g", hunt[0], hunt[1], hunt[2]);
    CHECK(fabs(ev_flip_hyab(a, b) - 35) < 1e-12, "HyAB %g, not 30 + 5", ev_flip_hyab(a, b));
    /* green (87.73, -75.61, 72.98) and blue (32.30, 25.58, -34.84) after Hunt */
    CHECK(fabs(pow(largest, 1 / 0.7) - (55.4377 + hypot(101.187, 107.813))) < 0.1, "the largest difference: %g",
          pow(largest, 1 / 0.7));
    CHECK(ev_flip_colour(0, largest) == 0, "no difference");
    CHECK(fabs(ev_flip_colour(pow(largest, 1 / 0.7), largest) - 1) < 1e-12, "the largest difference is not 1");
    CHECK(fabs(ev_flip_colour(pow(0.4 * largest, 1 / 0.7), largest) - 0.95) < 1e-9, "the knee is not at 0.95");
    CHECK(fabs(ev_flip_colour(pow(0.2 * largest, 1 / 0.7), largest) - 0.475) < 1e-9, "not linear below the knee");
    CHECK(fabs(ev_flip_colour(pow(0.7 * largest, 1 / 0.7), largest) - 0.975) < 1e-9, "not linear above the knee");
}

enum {
    R = 10,
    F = 9
}; /* radii of the contrast filters (3 sigma of the widest = 9.05 pixels) and of the features (3 sigma = 8.24) */

/* The two-dimensional filter of a channel, at its points. */
static void plain_csf(int channel, double g[2 * R + 1][2 * R + 1])
{
    static const double a[3][2] = {{1, 0}, {1, 0}, {34.1, 13.5}},
                        b[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
    double sum = 0;
    for (int y = -R; y <= R; y++)
        for (int x = -R; x <= R; x++) {
            const double d2 = (x * x + y * y) / (67.02064327658226 * 67.02064327658226);
            double v = 0;
            for (int k = 0; k < 2; k++)
                v += a[channel][k] * sqrt(PI / b[channel][k]) * exp(-PI * PI * d2 / b[channel][k]);
            sum += g[y + R][x + R] = v;
        }
    for (int i = 0; i < (2 * R + 1) * (2 * R + 1); i++) (&g[0][0])[i] /= sum;
}

static void plain_feature(bool point, double g[2 * F + 1][2 * F + 1])
{
    const double sd = 0.5 * 0.082 * 67.02064327658226;
    double plus = 0, minus = 0;
    for (int y = -F; y <= F; y++)
        for (int x = -F; x <= F; x++) {
            double v = exp(-(x * x + y * y) / (2 * sd * sd)) * (point ? x * x / (sd * sd) - 1 : -x);
            g[y + F][x + F] = v;
            if (v > 0) plus += v;
            else minus -= v;
        }
    for (int i = 0; i < (2 * F + 1) * (2 * F + 1); i++) (&g[0][0])[i] /= (&g[0][0])[i] > 0 ? plus : minus;
}

TEST(eval_flip_filters)
{
    double g[2 * R + 1][2 * R + 1], f[2 * F + 1][2 * F + 1];
    for (int c = 0; c < 3; c++) {
        double weight[2];
        ev_taps t[2];
        const int terms = ev_flip_csf(c, weight, t);
        plain_csf(c, g);
        CHECK(t[0].radius == R, "radius %d, not %d", t[0].radius, R);
        for (int y = 0; y <= 2 * R; y++)
            for (int x = 0; x <= 2 * R; x++) {
                double v = 0;
                for (int k = 0; k < terms; k++) v += weight[k] * t[k].tap[x] * t[k].tap[y];
                CHECK(fabs(v - g[y][x]) < 1e-14, "channel %d at %d, %d: %g, not %g", c, x, y, v, g[y][x]);
            }
    }
    for (int point = 0; point < 2; point++) {
        ev_taps d, s;
        ev_flip_feature(point, &d, &s);
        plain_feature(point, f);
        CHECK(d.radius == F && s.radius == F, "radius %d, not %d", d.radius, F);
        for (int y = 0; y <= 2 * F; y++)
            for (int x = 0; x <= 2 * F; x++)
                CHECK(fabs(d.tap[x] * s.tap[y] - f[y][x]) < 1e-14, "feature %d at %d, %d: %g, not %g", point, x, y,
                      d.tap[x] * s.tap[y], f[y][x]);
    }
}

/* in filtered by the n x n weights g, nearest pixel outside; turned: by its transpose. */
static void plain_filter(const double *in, int n, const double *g, bool turned, double *out)
{
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double sum = 0;
            for (int j = 0; j < n; j++)
                for (int i = 0; i < n; i++)
                    sum += g[turned ? i * n + j : j * n + i] * in[at(y + j - n / 2, H) * W + at(x + i - n / 2, W)];
            out[y * W + x] = sum;
        }
}

typedef struct plain {
    double lab[3][H * W], edge[2][H * W], point[2][H * W];
} plain;

static void plain_prepare(const float *p, plain *out)
{
    static double ycc[3][H * W], y[H * W];
    double g[2 * R + 1][2 * R + 1], f[2 * F + 1][2 * F + 1];
    for (int i = 0; i < H * W; i++) {
        const double rgb[3] = {(double)p[3 * i], (double)p[3 * i + 1], (double)p[3 * i + 2]};
        double v[3];
        ev_flip_ycxcz(rgb, v);
        for (int c = 0; c < 3; c++) ycc[c][i] = v[c];
        y[i] = (v[0] + 16) / 116;
    }
    for (int c = 0; c < 3; c++) {
        plain_csf(c, g);
        plain_filter(ycc[c], 2 * R + 1, &g[0][0], false, out->lab[c]);
    }
    for (int i = 0; i < H * W; i++) {
        double v[3] = {out->lab[0][i], out->lab[1][i], out->lab[2][i]}, rgb[3];
        ev_flip_rgb(v, rgb);
        for (int c = 0; c < 3; c++) rgb[c] = fmin(1, fmax(0, rgb[c]));
        ev_flip_lab(rgb, v);
        ev_flip_hunt(v);
        for (int c = 0; c < 3; c++) out->lab[c][i] = v[c];
    }
    for (int turned = 0; turned < 2; turned++) {
        plain_feature(false, f);
        plain_filter(y, 2 * F + 1, &f[0][0], turned, out->edge[turned]);
        plain_feature(true, f);
        plain_filter(y, 2 * F + 1, &f[0][0], turned, out->point[turned]);
    }
}

static double plain_flip(const float *a, const float *b)
{
    static plain p, q;
    plain_prepare(a, &p);
    plain_prepare(b, &q);
    double sum = 0;
    for (int i = 0; i < H * W; i++) {
        const double x[3] = {p.lab[0][i], p.lab[1][i], p.lab[2][i]}, y[3] = {q.lab[0][i], q.lab[1][i], q.lab[2][i]};
        const double edge = fabs(hypot(p.edge[0][i], p.edge[1][i]) - hypot(q.edge[0][i], q.edge[1][i]));
        const double point = fabs(hypot(p.point[0][i], p.point[1][i]) - hypot(q.point[0][i], q.point[1][i]));
        sum += pow(ev_flip_colour(ev_flip_hyab(x, y), ev_flip_largest()),
                   1 - fmin(1, pow(fmax(edge, point) / sqrt(2), 0.5)));
    }
    return sum / (H * W);
}

TEST(eval_flip_is_its_definition)
{
    static float a[N], b[N], map[H * W], other[H * W];
    for (uint64_t s = 1; s < 5; s++) {
        picture(s, a);
        picture(s + 1, b);
        const double got = ev_flip(H, W, a, b, map), expected = plain_flip(a, b);
        CHECK(fabs(got - expected) < 1e-12, "%.15g, not %.15g", got, expected);
        CHECK(ev_flip(H, W, b, a, NULL) == got, "it is not symmetrical");
        double sum = 0;
        for (int i = 0; i < H * W; i++) {
            CHECK(map[i] >= 0 && map[i] <= 1, "pixel %d: %g", i, (double)map[i]);
            sum += (double)map[i];
        }
        CHECK(fabs(sum / (H * W) - got) < 1e-6, "the map's mean %g is not %g", sum / (H * W), got);
        CHECK(ev_flip(H, W, a, a, map) == 0, "a picture differs from itself");
    }
    const double one = ev_flip(H, W, a, b, map);
    for (int n = 1; n < 8; n += 2) {
        ts_threads_set(n);
        CHECK(ev_flip(H, W, a, b, other) == one, "%d threads: another number", n);
    }
    ts_threads_set(0);
    for (int i = 0; i < N; i++)
        a[i] = i % 3 == 1, b[i] = i % 3 == 2; /* all green, all blue: no feature differs but the colour does, most */
    const double far = ev_flip(H, W, a, b, NULL);
    CHECK(fabs(far - 1) < 1e-9, "green and blue: %.12g, not 1", far);
    for (int i = 0; i < N; i++) a[i] = 7, b[i] = i % 5 ? 1 : INFINITY;
    CHECK(ev_flip(H, W, a, b, NULL) == 0, "values over 1 are not clamped");
    for (int i = 0; i < N; i++) a[i] = -3, b[i] = NAN;
    CHECK(ev_flip(H, W, a, b, NULL) == 0, "what is no light is not black");
    CHECK(isfinite(ev_flip(1, 1, a, b, NULL)), "a single pixel");
}

TEST(eval_angle_of_normals)
{
    static const double angle[] = {0, 1e-7, 1e-3, 0.1, 1, 30, 60, 89};
    for (size_t i = 0; i < sizeof angle / sizeof *angle; i++) {
        float a[2 * MAP_CHANNELS] = {0}, b[2 * MAP_CHANNELS] = {0};
        b[MAP_NORMAL] = (float)sin(angle[i] * PI / 180);
        b[MAP_CHANNELS + MAP_NORMAL + 1] = -b[MAP_NORMAL];
        const double got = rd_map_rmse(2, a, MAP_CHANNELS, b, MAP_CHANNELS).angle;
        CHECK(fabs(got - angle[i]) <= 1e-6 * angle[i] + (angle[i] > 80 ? 1e-3 : 0), "%.9g degrees, not %g", got,
              angle[i]);
    }
    float a[MAP_CHANNELS] = {0}, b[MAP_CHANNELS] = {0};
    a[MAP_NORMAL] = 1, b[MAP_NORMAL] = -1;
    CHECK(fabs(rd_map_rmse(1, a, MAP_CHANNELS, b, MAP_CHANNELS).angle - 180) < 1e-6, "opposite normals");
}

/* Numbers of other implementations for two pictures that a formula gives: FLIP's authors' (flip-evaluator 1.7, in
 * float) and scikit-image 0.26 (structural_similarity with gaussian_weights, sigma 1.5, without use_sample_covariance;
 * it crops the same border). */
TEST(eval_perception_as_other_implementations)
{
    enum { GH = 48, GW = 64 };
    static float a[GH * GW * 3], b[GH * GW * 3], map[GH * GW];
    for (int y = 0; y < GH; y++)
        for (int x = 0; x < GW; x++)
            for (int c = 0; c < 3; c++) {
                const int i = (y * GW + x) * 3 + c;
                a[i] = (float)(0.5 + 0.45 * sin(0.11 * x + 0.07 * y * (c + 1)));
                b[i] = (float)fmin(
                    1, fmax(0, 0.5 + 0.45 * sin(0.13 * x + 0.05 * y * (c + 1) + 0.3) + 0.1 * ((x / 8 + y / 8) % 2)));
            }
    const double flip = ev_flip(GH, GW, b, a, map), ssim = ev_ssim(GH, GW, a, b);
    CHECK(fabs(flip - 0.6089203) < 2e-6, "FLIP %.9g, not 0.6089203", flip);
    CHECK(fabs(ssim - 0.5437551777) < 1e-9, "SSIM %.11g, not 0.5437551777", ssim);
    static const struct {
        int at;
        double error;
    } pixel[] = {{0, 0.3090775}, {20 * GW + 30, 0.39558783}, {GH * GW - 1, 0.8801651}};
    for (int i = 0; i < 3; i++)
        CHECK(fabs((double)map[pixel[i].at] - pixel[i].error) < 5e-6, "pixel %d: %g, not %g", pixel[i].at,
              (double)map[pixel[i].at], pixel[i].error);
}
