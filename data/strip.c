/* Strips: five square panels side by side, input | normal | diffuse | roughness | specular, linear, OpenGL y. */
#include "data/image/image_read.h"
#include "data/material.h"
#include "data/name.h"
#include <string.h>

enum { NORMAL = 1, PANELS = 5 };

static ts_code cut_panel(const io_image *strip, int panel, int size, io_image *out, ts_status *st)
{
    int side = strip->height;
    io_image whole;
    if (io_image_create(&whole, side, side, 3, st) != TS_OK) return TS_NOMEM;
    for (int y = 0; y < side; y++)
        memcpy(whole.data + (size_t)y * (size_t)side * 3,
               strip->data + ((size_t)y * (size_t)strip->width + (size_t)panel * (size_t)side) * 3,
               (size_t)side * 3 * sizeof(float));
    for (size_t i = 0; panel != NORMAL && i < (size_t)side * (size_t)side * 3; i++)
        whole.data[i] = io_light(whole.data[i]);
    ts_code code = io_centre_square(&whole, size, 0, out, st);
    io_image_free(&whole);
    return code;
}

static void join_panels(const io_image panel[PANELS], io_material *m)
{
    for (size_t i = 0, n = (size_t)m->size * (size_t)m->size; i < n; i++) {
        const float *normal = panel[NORMAL].data + 3 * i, *rough = panel[3].data + 3 * i;
        io_texel t = {.roughness = (rough[0] + rough[1] + rough[2]) / 3};
        memcpy(t.diffuse, panel[2].data + 3 * i, sizeof t.diffuse);
        memcpy(t.specular, panel[4].data + 3 * i, sizeof t.specular);
        io_normal_decode(normal, false, t.normal);
        io_texel_put(m->maps + i * MAP_CHANNELS, &t);
    }
}

ts_code io_read_strip(const char *path, int size, io_material *m, io_image *input, ts_status *st)
{
    io_image strip, panel[PANELS] = {{0}};
    memset(m, 0, sizeof *m);
    if (input) memset(input, 0, sizeof *input);
    ts_code code = io_read_data(path, 3, IO_MAX_PIXELS_DEFAULT, &strip, st);
    if (code != TS_OK) return code;
    if ((int64_t)strip.height * PANELS != strip.width) {
        code = ts_fail(st, TS_FORMAT, "%s: %d x %d pixels is no strip of five square panels", path, strip.width,
                       strip.height);
        io_image_free(&strip);
        return code;
    }
    int side = size > 0 ? size : strip.height;
    for (int p = 0; p < PANELS && code == TS_OK; p++) code = cut_panel(&strip, p, side, &panel[p], st);
    if (code == TS_OK) code = io_material_create(m, side, st);
    if (code == TS_OK) {
        join_panels(panel, m);
        io_name_from_path(path, m->name, sizeof m->name);
        if (input) {
            *input = panel[0];
            panel[0] = (io_image){0};
        }
    }
    for (int p = 0; p < PANELS; p++) io_image_free(&panel[p]);
    io_image_free(&strip);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}

ts_code io_write_strip(const char *path, const io_material *m, const io_image *input, ts_status *st)
{
    if (input->width != m->size || input->height != m->size || input->channels != 3)
        return ts_fail(st, TS_INVALID, "%s: the input is %d x %d with %d channels, the maps are %d x %d", path,
                       input->width, input->height, input->channels, m->size, m->size);
    io_image strip;
    ts_code code = io_image_create(&strip, m->size * PANELS, m->size, 3, st);
    if (code != TS_OK) return code;
    for (int y = 0; y < m->size; y++)
        for (int x = 0; x < m->size; x++) {
            size_t i = (size_t)y * (size_t)m->size + (size_t)x;
            io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
            for (int c = 0; c < 3; c++) {
                float v[PANELS] = {input->data[3 * i + (size_t)c], t.normal[c] * 0.5f + 0.5f, t.diffuse[c], t.roughness,
                                   t.specular[c]};
                for (int p = 0; p < PANELS; p++)
                    strip.data[(((size_t)y * PANELS + (size_t)p) * (size_t)m->size + (size_t)x) * 3 + (size_t)c] = v[p];
            }
        }
    code = io_write_png(path, &strip, 16, false, st);
    io_image_free(&strip);
    return code;
}
