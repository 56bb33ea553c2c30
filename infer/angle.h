/* A photograph taken at an angle, from the corners of a square on the sample. */
#ifndef LGD_ANGLE_H
#define LGD_ANGLE_H
#include "data/image/image.h"
#include "data/rectify/corners.h"
#include "infer/lgd.h"

typedef struct lgd_rectified {
    io_image square;  /* linear, size a side; the caller frees it */
    char profile[96]; /* io_photo_facts.profile */
    bool transparent; /* io_photo_facts.transparent */
    io_pinhole camera;
    lgd_photo photo;    /* the square with the camera's place; the light is in the lens, and as strong as makes the
                           centre of the sample as bright as the default flash does */
    double side;        /* of the square in the photograph, the mean of the four in pixels */
    double fov;         /* degrees across the shorter side of the photograph */
    bool assumed;       /* nothing says the field of view: it is the default */
    char fov_from[128]; /* where it is known from, or why it is not */
} lgd_rectified;

/* Reads the photograph and rectifies it. fov: degrees across its shorter side; 0: from EXIF. r is empty after a
 * failure, whose line names the photograph. */
ts_code lgd_rectify(const char *path, const io_corners *corners, int64_t max_pixels, int size, double fov, int threads,
                    lgd_rectified *r, ts_status *st);

/* The photograph that the camera took of the square, the light at a place in its frame: right, down and forward of the
 * lens in sides of the square. */
lgd_photo lgd_photo_by(const io_pinhole *camera, const double light[3], const float *image);
#endif
