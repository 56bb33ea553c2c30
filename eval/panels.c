#include "eval/panels.h"
#include "data/name.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAPS = 4, NORMAL = 0, DIFFUSE, ROUGHNESS, SPECULAR, NINE = 1 + 2 * MAPS };

static ts_code cut(const io_image *sheet, int panel, int size, float (*decode)(float), io_image *out, ts_status *st)
{
    const size_t side = (size_t)sheet->height, row = side * 3;
    io_image whole;
    ts_code code = io_image_create(&whole, sheet->height, sheet->height, 3, st);
    if (code) return code;
    for (size_t y = 0; y < side; y++)
        for (size_t i = 0; i < row; i++) {
            const float v = sheet->data[(y * (size_t)sheet->width + (size_t)panel * side) * 3 + i];
            whole.data[y * row + i] = decode ? decode(v) : v;
        }
    code = io_centre_square(&whole, size, 0, out, st);
    io_image_free(&whole);
    return code;
}

static float decode_colour(float v) { return powf(fmaxf(v, 0), 2.2f); }
static float decode_roughness(float v) { return fminf(fmaxf((v - 0.1f) / 0.9f, 0), 1); }

/* The four maps from panel `first` on. */
static ts_code read_maps(const io_image *sheet, int first, int size, bool peer, io_material *m, ts_status *st)
{
    float (*const decode[MAPS])(float) = {NULL, peer ? decode_colour : NULL, peer ? decode_roughness : NULL,
                                          peer ? decode_colour : NULL};
    io_image panel[MAPS] = {{0}};
    io_material_free(m);
    ts_code code = io_material_create(m, size, st);
    for (int p = 0; p < MAPS && !code; p++) code = cut(sheet, first + p, size, decode[p], &panel[p], st);
    for (size_t i = 0; !code && i < (size_t)size * (size_t)size; i++) {
        const float *rough = panel[ROUGHNESS].data + 3 * i;
        io_texel t = {.roughness = (rough[0] + rough[1] + rough[2]) / 3};
        memcpy(t.diffuse, panel[DIFFUSE].data + 3 * i, sizeof t.diffuse);
        memcpy(t.specular, panel[SPECULAR].data + 3 * i, sizeof t.specular);
        io_normal_decode(panel[NORMAL].data + 3 * i, false, t.normal);
        io_texel_put(m->maps + i * MAP_CHANNELS, &t);
    }
    for (int p = 0; p < MAPS; p++) io_image_free(&panel[p]);
    return code;
}

static ts_code read_sheet(const char *path, int panels, io_image *sheet, ts_status *st)
{
    const ts_code code = io_read_data(path, 3, IO_MAX_PIXELS_DEFAULT, sheet, st);
    if (code || (int64_t)sheet->height * panels == sheet->width) return code;
    ts_fail(st, TS_FORMAT, "%s: %d x %d pixels: should be %d square panels side by side", path, sheet->width,
            sheet->height, panels);
    io_image_free(sheet);
    return st->code;
}

ts_code ev_read_nine_panels(const char *path, int size, float **input, io_material *truth, io_material *peer,
                            ts_status *st)
{
    io_image sheet, picture = {0};
    *input = NULL;
    ts_code code = read_sheet(path, NINE, &sheet, st);
    if (code) return code;
    code = read_maps(&sheet, 1, size, false, truth, st);
    if (!code) code = read_maps(&sheet, 1 + MAPS, size, true, peer, st);
    if (!code) code = cut(&sheet, 0, size, io_srgb_to_linear, &picture, st);
    io_image_free(&sheet);
    if (code) return ts_context(st, "%s", path);
    *input = picture.data;
    io_name_from_path(path, truth->name, sizeof truth->name);
    return TS_OK;
}

ts_code ev_read_four_panels(const char *path, int size, io_material *peer, ts_status *st)
{
    io_image sheet;
    ts_code code = read_sheet(path, MAPS, &sheet, st);
    if (code) return code;
    code = read_maps(&sheet, 0, size, true, peer, st);
    io_image_free(&sheet);
    return code ? ts_context(st, "%s", path) : TS_OK;
}
