/* A camera over a flat sample. The plane is z = 0, x right, y up, z toward the camera, in sides of the square that is
 * the sample (docs/conventions.md). Pixel (column i, row j) of the picture covers [i, i + 1) x [j, j + 1). */
#ifndef IO_PINHOLE_H
#define IO_PINHOLE_H
#include "data/rectify/homography.h"

typedef struct io_pinhole {
    double width, height;  /* of the picture in pixels; the axis meets its middle */
    double focal;          /* in pixels */
    double radial;         /* distortion: a ray at the tangent r from the axis is seen at r (1 + radial r^2) */
    double rotation[3][3]; /* rows: the picture's right, down and forward in the plane's coordinates */
    double at[3];          /* the camera's place */
} io_pinhole;

/* Where the point (z = 0) is seen. False: behind the camera. */
bool io_pinhole_see(const io_pinhole *c, const double point[2], double pixel[2]);

/* The camera that sees count points of the plane at these pixels, with the focal length and the distortion that c has:
 * from the homography (Zhang, "A Flexible New Technique for Camera Calibration", 2000, 3.1), then the least sum of
 * squared distances in pixels. *rms (may be NULL): of the distances' components. */
ts_code io_pinhole_pose(int count, const double (*point)[2], const double (*pixel)[2], io_pinhole *c, double *rms,
                        ts_status *st);

/* The rotation by |w| about the axis w (Rodrigues), times before. */
void io_rotate(const double w[3], const double before[3][3], double after[3][3]);

/* The angle in degrees between the plane's normal and the line from its centre to the camera. */
double io_pinhole_tilt(const io_pinhole *c);

/* Focal length in pixels of a picture whose shorter side spans fov degrees, and back. */
double io_focal_of(double fov, double width, double height);
double io_fov_of_focal(double focal, double width, double height);
#endif
