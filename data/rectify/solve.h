/* Cameras from the tags that they see: the poses, and what they share. */
#ifndef IO_SOLVE_H
#define IO_SOLVE_H
#include "data/rectify/pinhole.h"
#include "data/rectify/tags.h"

enum { IO_SOLVE_MOST = 100 };

typedef struct io_sight {
    io_tags tags;      /* tags that lie beside the others' fit are taken out */
    io_pinhole camera; /* before: width, height and focal length as it is known; after: all */
    double rms;        /* after: of the corners' distances, pixels */
} io_sight;

/* The least squares of the corners over every pose, one factor on all focal lengths and one radial distortion. A corner
 * counts with a deviation of 0.25 pixels, the factor with 0.02 (sure: the focal lengths are EXIF's) or 0.3 (they are a
 * guess), the distortion with 0.1: few photographs, or all from straight above, do not tell these two from the
 * distance. Several cameras in one set have lenses of their own, which this does not know. TS_INVALID or
 * TS_NUMERIC where a pose cannot be; *bad is then its sight, or -1 where it is no single one's. */
ts_code io_solve(io_sight *sight, int count, bool sure, int *bad, ts_status *st);
#endif
