#include "infer/preview.h"
#include "render/render.h"
#include "tensor/maps.h"
#include <stdlib.h>
#include <string.h>

/* A picture of square panels whose rows are rendered while they are written. photo: the first panel, or NULL. */
typedef struct strip {
    const io_material *m;
    const lgd_photo *photo;
    rd_view view[LGD_PREVIEW_LIGHTS];
    int panels;
} strip;

static ts_code make_rows(int y, int count, float *values, void *user, ts_status *st)
{
    const strip *s = user;
    const int size = s->m->size;
    const size_t panel = (size_t)size * 3, row = panel * (size_t)s->panels, first = (size_t)y * (size_t)size;
    float *picture = malloc((size_t)count * panel * sizeof *picture);
    if (!picture) return ts_fail(st, TS_NOMEM, "out of memory");
    for (int k = 0; k < s->panels; k++) {
        const float *from = k == 0 && s->photo ? s->photo->image + first * 3 : picture;
        if (from == picture)
            rd_render((rd_grid){.h = count, .w = size, .y0 = y, .side = size, .threads = 1},
                      s->m->maps + first * MAP_CHANNELS, MAP_CHANNELS, &s->view[k], true, picture);
        for (int i = 0; i < count; i++)
            memcpy(values + (size_t)i * row + (size_t)k * panel, from + (size_t)i * panel, panel * sizeof *values);
    }
    free(picture);
    return TS_OK;
}

static ts_code write_strip(const char *path, strip *s, ts_status *st)
{
    const io_rows rows = {s->panels * s->m->size, s->m->size, 3, make_rows, s};
    return io_write_png_rows(path, &rows, 8, true, st);
}

ts_code lgd_write_render(const char *path, const io_material *m, const lgd_photo *photo, double ambient, ts_status *st)
{
    strip s = {.m = m, .photo = photo, .panels = 2};
    s.view[1] = (rd_view){.kind = RD_POINT, .power = photo->power, .ambient = (float)ambient};
    memcpy(s.view[1].light, photo->light, sizeof photo->light);
    memcpy(s.view[1].camera, photo->camera, sizeof photo->camera);
    return write_strip(path, &s, st);
}

rd_view lgd_preview_view(int index, const lgd_photo *photo)
{
    rd_view view = rd_preview_view(index, LGD_PREVIEW_LIGHTS);
    view.camera[2] = photo->camera[2];
    return view;
}

ts_code lgd_write_preview(const char *path, const io_material *m, const lgd_photo *photo, ts_status *st)
{
    strip s = {.m = m, .panels = LGD_PREVIEW_LIGHTS};
    for (int i = 0; i < s.panels; i++) s.view[i] = lgd_preview_view(i, photo);
    return write_strip(path, &s, st);
}
