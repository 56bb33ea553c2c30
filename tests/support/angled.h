/* A pattern on the sample, and pictures that pinhole cameras take of it. */
#ifndef ANGLED_H
#define ANGLED_H
#include "data/image/image.h"
#include "data/rectify/pinhole.h"
#include "tests/test.h"
#include <math.h>

/* Of a camera `distance` sides away, tilted by `tilt` degrees toward the direction `turn`, its picture rolled about its
 * axis by `roll` radians; the axis meets the sample's centre. */
static inline io_pinhole angled_camera(int width, int height, double focal, double distance, double tilt, double turn,
                                       double roll)
{
    const double a = tilt / 57.29577951308232, ahead[3] = {-sin(a) * cos(turn), -sin(a) * sin(turn), -cos(a)};
    io_pinhole c = {width, height, focal, 0, {{0}}, {0}};
    for (int k = 0; k < 3; k++) c.at[k] = -distance * ahead[k], c.rotation[2][k] = ahead[k];
    const double level[3] = {cos(roll), sin(roll), 0};
    double along = 0, length = 0;
    for (int k = 0; k < 3; k++) along += level[k] * ahead[k];
    for (int k = 0; k < 3; k++)
        c.rotation[0][k] = level[k] - along * ahead[k], length += c.rotation[0][k] * c.rotation[0][k];
    for (int k = 0; k < 3; k++) c.rotation[0][k] /= sqrt(length);
    for (int k = 0; k < 3; k++)
        c.rotation[1][k] = ahead[(k + 1) % 3] * c.rotation[0][(k + 2) % 3] -
            ahead[(k + 2) % 3] * c.rotation[0][(k + 1) % 3];
    return c;
}

static const double angled_square[4][2] = {{-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}};

static inline float angled_pattern(const double p[2], int channel)
{
    return (float)(0.5 + 0.2 * sin(9 * p[0] + channel) + 0.2 * cos(7 * p[1] - 3 * p[0]));
}

/* The point of the plane behind a pixel of an undistorted camera. */
static inline void angled_point(const io_pinhole *c, double x, double y, double p[2])
{
    const double q[3] = {(x - c->width / 2) / c->focal, (y - c->height / 2) / c->focal, 1};
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = q[0] * c->rotation[0][k] + q[1] * c->rotation[1][k] + q[2] * c->rotation[2][k];
    for (int k = 0; k < 2; k++) p[k] = c->at[k] - d[k] * c->at[2] / d[2];
}

/* Writes the picture of the pattern. */
static inline void angled_write(const char *path, const io_pinhole *c)
{
    io_image image;
    ts_status st = {0};
    CHECK(!io_image_create(&image, (int)c->width, (int)c->height, 3, &st), "%s", st.message);
    for (int j = 0; j < image.height; j++)
        for (int i = 0; i < image.width; i++) {
            double p[2];
            angled_point(c, i + 0.5, j + 0.5, p);
            for (int k = 0; k < 3; k++)
                image.data[((size_t)j * (size_t)image.width + (size_t)i) * 3 + (size_t)k] = angled_pattern(p, k);
        }
    CHECK(!io_write_png(path, &image, 16, true, &st), "%s", st.message);
    io_image_free(&image);
}
#endif
