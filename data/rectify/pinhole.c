#include "data/rectify/pinhole.h"
#include "data/rectify/least_squares.h"
#include <math.h>
#include <string.h>

#define DEGREES 57.295779513082320877

double io_focal_of(double fov, double width, double height)
{
    return fmin(width, height) / (2 * tan(fov / 2 / DEGREES));
}

double io_fov_of_focal(double focal, double width, double height)
{
    return 2 * DEGREES * atan(fmin(width, height) / (2 * focal));
}

double io_pinhole_tilt(const io_pinhole *c) { return DEGREES * atan2(hypot(c->at[0], c->at[1]), c->at[2]); }

bool io_pinhole_see(const io_pinhole *c, const double point[2], double pixel[2])
{
    const double d[3] = {point[0] - c->at[0], point[1] - c->at[1], -c->at[2]};
    double q[3];
    for (int i = 0; i < 3; i++) q[i] = c->rotation[i][0] * d[0] + c->rotation[i][1] * d[1] + c->rotation[i][2] * d[2];
    const double x = q[0] / q[2], y = q[1] / q[2], seen = c->focal * (1 + c->radial * (x * x + y * y));
    pixel[0] = c->width / 2 + seen * x;
    pixel[1] = c->height / 2 + seen * y;
    return q[2] > 0;
}

void io_rotate(const double w[3], const double before[3][3], double after[3][3])
{
    const double angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double s = angle > 1e-9 ? sin(angle) / angle : 1, v = angle > 1e-9 ? (1 - cos(angle)) / (angle * angle) : 0.5;
    double r[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) r[i][k] = v * w[i] * w[k] + (i == k ? cos(angle) : 0);
    r[0][1] -= s * w[2], r[0][2] += s * w[1], r[1][2] -= s * w[0];
    r[1][0] += s * w[2], r[2][0] -= s * w[1], r[2][1] += s * w[0];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            after[i][k] = r[i][0] * before[0][k] + r[i][1] * before[1][k] + r[i][2] * before[2][k];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* [r1 r2 t] = K^-1 H up to a factor, whose sign puts the camera above the plane. */
static bool start(const io_homography *h, io_pinhole *c)
{
    double column[3][3], up[3];
    for (int k = 0; k < 3; k++) {
        column[k][0] = (h->m[0][k] - c->width / 2 * h->m[2][k]) / c->focal;
        column[k][1] = (h->m[1][k] - c->height / 2 * h->m[2][k]) / c->focal;
        column[k][2] = h->m[2][k];
    }
    double scale = sqrt(sqrt(dot(column[0], column[0]) * dot(column[1], column[1])));
    if (!(scale > 0)) return false;
    if (column[2][2] < 0) scale = -scale; /* the centre is in front of the camera */
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) column[k][i] /= scale;
    /* the nearest directions at a right angle to each other: of unit vectors, sum and difference are */
    double sum[3], difference[3];
    const double one = sqrt(dot(column[0], column[0])), two = sqrt(dot(column[1], column[1]));
    for (int i = 0; i < 3; i++) {
        sum[i] = column[0][i] / one + column[1][i] / two;
        difference[i] = column[0][i] / one - column[1][i] / two;
    }
    const double a = sqrt(2 * dot(sum, sum)), b = sqrt(2 * dot(difference, difference));
    if (!(a > 0) || !(b > 0)) return false;
    double r1[3], r2[3];
    for (int i = 0; i < 3; i++) r1[i] = sum[i] / a + difference[i] / b, r2[i] = sum[i] / a - difference[i] / b;
    for (int i = 0; i < 3; i++) up[i] = r1[(i + 1) % 3] * r2[(i + 2) % 3] - r1[(i + 2) % 3] * r2[(i + 1) % 3];
    for (int i = 0; i < 3; i++) c->rotation[i][0] = r1[i], c->rotation[i][1] = r2[i], c->rotation[i][2] = up[i];
    for (int k = 0; k < 3; k++) {
        c->at[k] = 0;
        for (int i = 0; i < 3; i++) c->at[k] -= c->rotation[i][k] * column[2][i];
    }
    return c->at[2] > 0;
}

typedef struct fit {
    int count;
    const double (*point)[2], (*pixel)[2];
    const io_pinhole *first;
} fit;

/* x: a rotation, and the camera's place. */
static io_pinhole moved(const io_pinhole *first, const double x[6])
{
    io_pinhole c = *first;
    io_rotate(x, first->rotation, c.rotation);
    memcpy(c.at, x + 3, sizeof c.at);
    return c;
}

static void distances(const double *x, double *residual, void *user)
{
    const fit *f = user;
    const io_pinhole c = moved(f->first, x);
    for (int i = 0; i < f->count; i++) {
        io_pinhole_see(&c, f->point[i], residual + 2 * i);
        for (int k = 0; k < 2; k++) residual[2 * i + k] -= f->pixel[i][k];
    }
}

ts_code io_pinhole_pose(int count, const double (*point)[2], const double (*pixel)[2], io_pinhole *c, double *rms,
                        ts_status *st)
{
    const double step[6] = {1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5};
    io_homography h;
    if (!io_homography_fit(count, point, pixel, &h) || !start(&h, c))
        return ts_fail(st, TS_INVALID, "these points are not those of a flat square that a camera sees from above");
    const io_pinhole first = *c;
    fit f = {count, point, pixel, &first};
    double x[6] = {0, 0, 0, c->at[0], c->at[1], c->at[2]};
    const io_problem p = {6, 2 * count, step, distances, &f};
    const ts_code code = io_least_squares(&p, x, rms, st);
    if (code) return code;
    *c = moved(&first, x);
    return c->at[2] > 0 ? TS_OK : ts_fail(st, TS_INVALID, "these points put the camera below the sample");
}
