/* Planar homographies: what a pinhole camera does to a plane. */
#ifndef IO_HOMOGRAPHY_H
#define IO_HOMOGRAPHY_H
#include "tensor/status.h"
#include <stdbool.h>

typedef struct io_homography {
    double m[3][3]; /* to = (m0 . (x, y, 1), m1 . (x, y, 1)) / m2 . (x, y, 1) */
} io_homography;

void io_homography_apply(const io_homography *h, const double from[2], double to[2]);

/* From count >= 4 pairs of points, by the direct linear transformation with normalised points (Hartley and Zisserman,
 * "Multiple View Geometry", 2004, 4.1 and 4.4) and m[2][2] = 1 at the centroid, which is in front of the camera. False:
 * the points do not give one (three of four in a line, or all in one). */
bool io_homography_fit(int count, const double (*from)[2], const double (*to)[2], io_homography *h);

/* corner: [4], the corners of a square in a photograph of width x height pixels, top left, top right, bottom right,
 * bottom left of the square, in any rotation. TS_INVALID, with a line that says what to do: outside the picture, lines
 * that cross, three nearly in a line, the mirror image (counter-clockwise). */
ts_code io_corners_check(const double (*corner)[2], int width, int height, ts_status *st);
#endif
