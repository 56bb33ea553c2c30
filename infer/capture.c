#include "infer/capture.h"
#include "data/capture_ini.h"
#include "nn/clip.h"
#include "render/render.h"
#include <math.h>
#include <string.h>
#include <sys/stat.h>

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

void lgd_capture_gain(const io_capture *c, bool as_taken, float gain[3])
{
    const float *l = c->light[0], distance2 = l[0] * l[0] + l[1] * l[1] + l[2] * l[2], cosine = l[2] / sqrtf(distance2);
    const float white = cbrtf(c->power[0] * c->power[1] * c->power[2]),
                all = as_taken ? 1
                               : RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE) * distance2 / cosine / white;
    for (int i = 0; i < 3; i++) gain[i] = all * (white / c->power[i]);
}

ts_code lgd_read_capture(const char *path, int size, int64_t max_pixels, bool as_taken, io_capture *c, ts_status *st)
{
    const ts_code code = is_folder(path) ? io_read_capture(path, size, max_pixels, c, st)
                                         : io_read_capture_ini(path, size, RD_FLASH_POWER, max_pixels, c, st);
    if (code) return code;
    float gain[3];
    lgd_capture_gain(c, as_taken, gain);
    for (int i = 0; i < 3; i++) c->power[i] *= gain[i];
    const size_t values = (size_t)c->images * (size_t)size * (size_t)size * 3;
    for (size_t i = 0; i < values; i++) c->image[i] *= gain[i % 3];
    nn_clip((int64_t)values, c->image, c->image);
    return TS_OK;
}

int lgd_capture_photos(const io_capture *c, int most, lgd_photo *photo)
{
    const int count = c->images < most ? c->images : most;
    for (int k = 0; k < count; k++) {
        photo[k] = (lgd_photo){.image = c->image + (size_t)k * (size_t)c->size * (size_t)c->size * 3,
                               .power = c->power[0]};
        memcpy(photo[k].light, c->light[k], sizeof photo[k].light);
        memcpy(photo[k].camera, c->camera[k], sizeof photo[k].camera);
    }
    return count;
}
