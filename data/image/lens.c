#include "data/image/lens.h"
#include <math.h>
#include <stdio.h>

#define DIAGONAL_35MM 43.266615305567875 /* of 36 x 24 mm */
#define DEGREES 57.295779513082320877
#define SAME_SHAPE 0.01 /* of the ratio of the sides: a few rows are cut off by some programs */

static double ratio(int a, int b) { return a > b ? (double)a / b : (double)b / a; }

/* The focal length in pixels of the picture, or 0. */
static double pixels(const io_lens *l, int width, int height, char *why, size_t size)
{
    const double zoom = l->zoom > 1 ? l->zoom : 1;
    if (l->focal_35mm > 0) {
        const double more = l->zoom_in_focal35 ? 1 : zoom, millimetres = l->focal_35mm * more;
        if (more > 1) snprintf(why, size, "EXIF: %g mm on 35 mm film and %.3g times digital zoom", l->focal_35mm, more);
        else snprintf(why, size, "EXIF: %g mm on 35 mm film", l->focal_35mm);
        return millimetres * hypot(width, height) / DIAGONAL_35MM;
    }
    if (l->focal > 0 && l->plane > 0) {
        /* the resolution is that of the picture as it was taken; this one may have been reduced since */
        const int taken = l->width > l->height ? l->width : l->height, now = width > height ? width : height;
        const double reduced = taken > 0 ? (double)now / taken : 1;
        snprintf(why, size, "EXIF: %g mm with %.5g pixels per mm", l->focal, l->plane);
        return l->focal * l->plane * reduced * zoom;
    }
    snprintf(why, size, "%s",
             l->focal > 0 ? "its EXIF has a focal length, but not the sensor's size"
                          : "it has no focal length in its EXIF");
    return 0;
}

double io_lens_fov(const io_lens *l, int width, int height, char *why, size_t size)
{
    const double f = pixels(l, width, height, why, size);
    if (!(f > 0)) return 0;
    if (l->width > 0 && l->height > 0 && fabs(ratio(l->width, l->height) / ratio(width, height) - 1) > SAME_SHAPE) {
        snprintf(why, size, "it was cut from %d x %d pixels", l->width, l->height);
        return 0;
    }
    const double fov = 2 * DEGREES * atan((width < height ? width : height) / (2 * f));
    if (fov >= IO_FOV_LEAST && fov <= IO_FOV_MOST) return fov;
    snprintf(why, size, "its EXIF's focal length cannot be");
    return 0;
}
