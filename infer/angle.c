#include "infer/angle.h"
#include "render/scene.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

lgd_photo lgd_photo_by(const io_pinhole *camera, const double light[3], const float *image)
{
    lgd_photo p = {.image = image};
    double at[3], distance2 = 0;
    for (int k = 0; k < 3; k++) {
        at[k] = camera->at[k];
        for (int i = 0; i < 3; i++) at[k] += camera->rotation[i][k] * light[i];
        distance2 += at[k] * at[k];
        p.camera[k] = (float)camera->at[k];
        p.light[k] = (float)at[k];
    }
    const double at_default = RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE);
    p.power = (float)(at_default * distance2 * sqrt(distance2) / at[2]);
    return p;
}

ts_code lgd_rectify(const char *path, const io_corners *corners, int64_t max_pixels, int size, double fov, int threads,
                    lgd_rectified *r, ts_status *st)
{
    io_photo_rows photo;
    *r = (lgd_rectified){.fov = fov};
    ts_code code = io_photo_open(path, max_pixels, true, &photo, st);
    if (code) {
        *r = (lgd_rectified){0};
        return code;
    }
    memcpy(r->profile, photo.unread, sizeof r->profile);
    r->transparent = photo.transparent;
    if (fov > 0) snprintf(r->fov_from, sizeof r->fov_from, "--fov");
    else r->fov = io_lens_fov(&photo.raw.lens, photo.width, photo.height, r->fov_from, sizeof r->fov_from);
    r->assumed = !(r->fov > 0);
    if (r->assumed) r->fov = LGD_FOV_DEFAULT;
    const double none[3] = {0};
    code = io_corners_rectify(&photo, corners, r->fov, size, threads, &r->square, &r->camera, &r->side, st);
    if (!code) r->photo = lgd_photo_by(&r->camera, none, r->square.data);
    else {
        io_image_free(&r->square);
        *r = (lgd_rectified){0};
        ts_context(st, "%s", path);
    }
    io_photo_close(&photo);
    return code;
}
