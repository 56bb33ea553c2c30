#include "infer/api.h"
#include "data/material.h"
#include "tensor/team.h"
#include <math.h>
#include <string.h>

_Static_assert(sizeof((lgd_error *)0)->message == sizeof((ts_status *)0)->message, "messages are copied whole");

int lgd_report(lgd_error *error, const ts_status *st)
{
    if (error) {
        error->code = st->code;
        memcpy(error->message, st->message, sizeof error->message);
    }
    return st->code;
}

ts_code lgd_take_struct(const char *call, const void *given, size_t least, void *own, size_t size, ts_status *st)
{
    size_t theirs;
    if (!given) return TS_OK;
    memcpy(&theirs, given, sizeof theirs);
    if (theirs < least || theirs > LGD_STRUCT_MOST)
        return ts_fail(st, TS_INVALID, "%s: options.size is %zu: begin with a struct of the defaults, as lgd.h says",
                       call, theirs);
    for (size_t i = size; i < theirs; i++)
        if (((const unsigned char *)given)[i])
            return ts_fail(st, TS_UNSUPPORTED,
                           "%s: the options (%zu bytes) set a field that lgd %s (%zu bytes) does not have: link with a "
                           "newer liblgd or leave the field zero",
                           call, theirs, LGD_VERSION, size);
    memcpy(own, given, theirs < size ? theirs : size);
    memcpy(own, &size, sizeof size);
    return TS_OK;
}

bool lgd_photo_can_be(const lgd_photo *p)
{
    bool fine = isfinite(p->power) && p->power > 0 && p->light[2] > 0 && p->camera[2] > 0;
    for (int i = 0; i < 3; i++) fine = fine && isfinite(p->light[i]) && isfinite(p->camera[i]);
    return fine;
}

typedef struct encoding {
    const float *maps;
    float *encoded;
} encoding;

static void encode_pixels(const void *job, int64_t begin, int64_t end)
{
    const encoding *e = job;
    for (int64_t i = begin; i < end; i++) {
        const float *m = e->maps + i * MAP_CHANNELS;
        const float x = m[MAP_NORMAL], y = m[MAP_NORMAL + 1];
        io_texel t = {.normal = {x, y, sqrtf(fmaxf(1 - x * x - y * y, 0))}, .roughness = m[MAP_ROUGHNESS]};
        memcpy(t.diffuse, m + MAP_DIFFUSE, sizeof t.diffuse);
        memcpy(t.specular, m + MAP_SPECULAR, sizeof t.specular);
        io_texel_put(e->encoded + i * MAP_CHANNELS, &t);
    }
}

void lgd_encode(const float *maps, int side, int threads, float *encoded)
{
    enum { STEP = 1 << 10 };
    ts_for(threads, (int64_t)side * side, STEP, encode_pixels, &(encoding){maps, encoded});
}
