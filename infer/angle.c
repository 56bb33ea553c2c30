#include "infer/angle.h"
#include "data/rectify/warp.h"
#include "render/scene.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The corners of the sample in its own coordinates. */
static const double own[4][2] = {{-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}};

ts_code lgd_angle_parse(const char *const *words, int count, lgd_angle *angle, ts_status *st)
{
    double *to = &angle->corner[0][0];
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
    if (points == 4) return io_corners_check((const double(*)[2])angle->corner, INT_MAX, INT_MAX, st);
    return ts_fail(st, TS_INVALID,
                   "%d corners are given: four x,y are needed, top left, top right, bottom right, "
                   "bottom left",
                   points);
}

/* Shares to pixels. */
static void in_pixels(const lgd_angle *angle, int width, int height, double corner[4][2])
{
    bool shares = true;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) shares = shares && angle->corner[i][k] >= 0 && angle->corner[i][k] <= 1;
    for (int i = 0; i < 4; i++) {
        corner[i][0] = angle->corner[i][0] * (shares ? width : 1);
        corner[i][1] = angle->corner[i][1] * (shares ? height : 1);
    }
}

lgd_photo lgd_photo_by(const io_pinhole *camera, const double light[3], const float *image)
{
    lgd_photo p = {.image = image};
    double at[3], distance2 = 0;
    for (int k = 0; k < 3; k++) {
        at[k] = camera->at[k];
        for (int i = 0; i < 3; i++) at[k] += camera->turn[i][k] * light[i];
        distance2 += at[k] * at[k];
        p.camera[k] = (float)camera->at[k];
        p.light[k] = (float)at[k];
    }
    const double usual = RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE);
    p.power = (float)(usual * distance2 * sqrt(distance2) / at[2]);
    return p;
}

static void pixel_of(const double point[2], double pixel[2], const void *user)
{
    io_homography_apply(user, point, pixel);
}

static ts_code rectify(const io_photo_rows *photo, const lgd_angle *angle, int size, int threads, lgd_rectified *r,
                       ts_status *st)
{
    const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, none[3] = {0};
    double corner[4][2];
    io_homography h;
    in_pixels(angle, photo->width, photo->height, corner);
    if (io_corners_check((const double(*)[2])corner, photo->width, photo->height, st) != TS_OK) return st->code;
    r->camera = (io_pinhole){photo->width, photo->height, io_focal_of(r->fov, photo->width, photo->height), 0, {{0}},
                             {0}};
    if (io_pinhole_pose(4, own, (const double(*)[2])corner, &r->camera, NULL, st) != TS_OK) return st->code;
    if (!io_homography_fit(4, square, (const double(*)[2])corner, &h))
        return ts_fail(st, TS_INVALID, "the corners are not those of a square");
    for (int i = 0; i < 4; i++)
        r->side += hypot(corner[i][0] - corner[(i + 1) % 4][0], corner[i][1] - corner[(i + 1) % 4][1]) / 4;
    const ts_code code = io_warp(photo, &(io_view_of){pixel_of, &h}, size, threads, &r->square, st);
    if (!code) r->photo = lgd_photo_by(&r->camera, none, r->square.data);
    return code;
}

ts_code lgd_rectify(const char *path, const lgd_angle *angle, int64_t max_pixels, int size, double fov, int threads,
                    lgd_rectified *r, ts_status *st)
{
    io_photo_rows photo;
    *r = (lgd_rectified){.fov = fov};
    if (io_photo_open(path, max_pixels, true, &photo, st) != TS_OK) return st->code;
    r->facts = (io_photo_facts){photo.width, photo.height, photo.raw.lens};
    if (fov > 0) snprintf(r->fov_from, sizeof r->fov_from, "--fov");
    else r->fov = io_lens_fov(&photo.raw.lens, photo.width, photo.height, r->fov_from, sizeof r->fov_from);
    r->assumed = !(r->fov > 0);
    if (r->assumed) r->fov = LGD_FOV_DEFAULT;
    const ts_code code = rectify(&photo, angle, size, threads, r, st);
    if (code) {
        io_image_free(&r->square);
        ts_context(st, "%s", path);
    }
    io_photo_close(&photo);
    return code;
}
