#include "data/rectify/homography.h"
#include "data/rectify/least_squares.h"
#include <math.h>
#include <string.h>

void io_homography_apply(const io_homography *h, const double from[2], double to[2])
{
    double v[3];
    for (int i = 0; i < 3; i++) v[i] = h->m[i][0] * from[0] + h->m[i][1] * from[1] + h->m[i][2];
    to[0] = v[0] / v[2];
    to[1] = v[1] / v[2];
}

/* Brings points to the centroid 0 and the mean distance sqrt 2. */
typedef struct norm {
    double x, y, scale;
} norm;

static norm norm_of(int count, const double (*p)[2])
{
    norm n = {0};
    double away = 0;
    for (int i = 0; i < count; i++) n.x += p[i][0] / count, n.y += p[i][1] / count;
    for (int i = 0; i < count; i++) away += hypot(p[i][0] - n.x, p[i][1] - n.y) / count;
    n.scale = away > 0 ? 1.41421356237309504880 / away : 0;
    return n;
}

bool io_homography_fit(int count, const double (*from)[2], const double (*to)[2], io_homography *h)
{
    const norm a = norm_of(count, from), b = norm_of(count, to);
    double normal[8][8] = {{0}}, right[8] = {0}, x[8];
    if (count < 4 || !(a.scale > 0) || !(b.scale > 0)) return false;
    for (int i = 0; i < count; i++) {
        const double px = (from[i][0] - a.x) * a.scale, py = (from[i][1] - a.y) * a.scale;
        const double q[2] = {(to[i][0] - b.x) * b.scale, (to[i][1] - b.y) * b.scale};
        for (int k = 0; k < 2; k++) {
            double row[8] = {0};
            row[3 * k] = px, row[3 * k + 1] = py, row[3 * k + 2] = 1;
            row[6] = -px * q[k], row[7] = -py * q[k];
            for (int r = 0; r < 8; r++) {
                right[r] += row[r] * q[k];
                for (int c = 0; c < 8; c++) normal[r][c] += row[r] * row[c];
            }
        }
    }
    memcpy(x, right, sizeof x);
    if (!io_solve_symmetric(8, &normal[0][0], x)) return false;
    /* to = B^-1 G A of the normalised G */
    const double g[3][3] = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], 1}};
    double ga[3][3];
    for (int i = 0; i < 3; i++) {
        ga[i][0] = g[i][0] * a.scale;
        ga[i][1] = g[i][1] * a.scale;
        ga[i][2] = g[i][2] - a.scale * (g[i][0] * a.x + g[i][1] * a.y);
    }
    for (int k = 0; k < 3; k++) {
        h->m[0][k] = ga[0][k] / b.scale + b.x * ga[2][k];
        h->m[1][k] = ga[1][k] / b.scale + b.y * ga[2][k];
        h->m[2][k] = ga[2][k];
    }
    return true;
}

ts_code io_corners_check(const double (*corner)[2], int width, int height, ts_status *st)
{
    enum { FLAT = 100 }; /* a triangle's area is less than the longest side squared over this: nearly a line */
    double longest = 0, turn[4];
    int left = 0, right = 0;
    for (int i = 0; i < 4; i++) {
        const double *p = corner[i], *q = corner[(i + 1) % 4], *r = corner[(i + 2) % 4];
        if (!(p[0] >= 0 && p[0] <= width && p[1] >= 0 && p[1] <= height))
            return ts_fail(st, TS_INVALID, "corner %d at %g,%g is outside the photograph of %d x %d pixels", i + 1,
                           p[0], p[1], width, height);
        longest = fmax(longest, hypot(q[0] - p[0], q[1] - p[1]));
        turn[i] = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]);
    }
    for (int i = 0; i < 4; i++) {
        if (!(fabs(turn[i]) * FLAT > 2 * longest * longest))
            return ts_fail(st, TS_INVALID,
                           "corners %d, %d and %d are nearly in a line: give the four corners of a square", i + 1,
                           (i + 1) % 4 + 1, (i + 2) % 4 + 1);
        left += turn[i] < 0;
        right += turn[i] > 0;
    }
    if (left && right)
        return ts_fail(st, TS_INVALID,
                       "the lines between the corners cross: give them in the order top left, top right, bottom right, "
                       "bottom left");
    if (left)
        return ts_fail(
            st, TS_INVALID,
            "the corners are in counter-clockwise order, which mirrors the sample: give them in the order top "
            "left, top right, bottom right, bottom left");
    return TS_OK;
}
