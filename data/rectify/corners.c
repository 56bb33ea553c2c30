#include "data/rectify/corners.h"
#include "data/rectify/warp.h"
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The corners of the sample in its own coordinates. */
static const double own[4][2] = {{-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}};

ts_code io_corners_parse(const char *const *words, int count, io_corners *corners, ts_status *st)
{
    double *to = &corners->at[0][0];
    int points = 0;
    for (int i = 0; i < count; i++)
        for (const char *p = words[i] + strspn(words[i], " "); *p; p += strspn(p, " ")) {
            char *comma, *end;
            const double x = strtod(p, &comma);
            const double y = *comma == ',' && comma > p ? strtod(comma + 1, &end) : (end = comma, 0);
            if (*comma != ',' || comma == p || end == comma + 1 || (*end && *end != ' ') || !isfinite(x) ||
                !isfinite(y) || points == 4)
                return ts_fail(st, TS_INVALID, "'%.60s' is not a corner: four x,y are needed, such as 120,80", p);
            *to++ = x;
            *to++ = y;
            points++;
            p = end;
        }
    for (int k = 0; k < points; k++)
        if (corners->at[k][0] < 0 || corners->at[k][1] < 0)
            return ts_fail(st, TS_INVALID, "corner %d at %g,%g is outside the photograph", k + 1, corners->at[k][0],
                           corners->at[k][1]);
    if (points == 4) return io_corners_check((const double(*)[2])corners->at, INT_MAX, INT_MAX, st);
    return ts_fail(st, TS_INVALID,
                   "%d corners are given: four x,y are needed, top left, top right, bottom right, "
                   "bottom left",
                   points);
}

/* Shares to pixels. */
static void in_pixels(const io_corners *corners, int width, int height, double corner[4][2])
{
    bool shares = true;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) shares = shares && corners->at[i][k] >= 0 && corners->at[i][k] <= 1;
    for (int i = 0; i < 4; i++) {
        corner[i][0] = corners->at[i][0] * (shares ? width : 1);
        corner[i][1] = corners->at[i][1] * (shares ? height : 1);
    }
}

static void pixel_of(const double point[2], double pixel[2], const void *user)
{
    io_homography_apply(user, point, pixel);
}

ts_code io_corners_rectify(const io_photo_rows *photo, const io_corners *corners, double fov, int size, int threads,
                           io_image *square, io_pinhole *camera, double *side, ts_status *st)
{
    const double unit[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    double corner[4][2];
    const double(*given)[2] = (const double(*)[2])corner;
    io_homography h;
    *square = (io_image){0};
    in_pixels(corners, photo->width, photo->height, corner);
    if (io_corners_check(given, photo->width, photo->height, st) != TS_OK) return st->code;
    *camera = (io_pinhole){.width = photo->width, .height = photo->height};
    camera->focal = io_focal_of(fov, photo->width, photo->height);
    if (io_pinhole_pose(4, own, given, camera, NULL, st) != TS_OK) return st->code;
    if (!io_homography_fit(4, unit, given, &h)) return ts_fail(st, TS_INVALID, "the corners are not those of a square");
    if (side) *side = 0;
    for (int i = 0; i < 4 && side; i++)
        *side += hypot(corner[i][0] - corner[(i + 1) % 4][0], corner[i][1] - corner[(i + 1) % 4][1]) / 4;
    return io_warp(photo, &(io_view_of){pixel_of, &h}, size, threads, square, st);
}
