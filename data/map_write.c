/* Maps as picture files in a folder, and the meta.txt that says what they mean. */
#include "data/image/exr.h"
#include "data/material.h"
#include "data/text.h"
#include <limits.h>
#include <stdio.h>
#include <string.h>

typedef struct map {
    const io_material *m;
    unsigned which;
    bool directx;
} map;

/* Rows of a map: diffuse, specular and roughness in [0, 1], normals as (n + 1) / 2. */
static ts_code make_rows(int y, int count, float *out, void *user, ts_status *st)
{
    const map *q = user;
    const size_t first = (size_t)y * (size_t)q->m->size, pixels = (size_t)count * (size_t)q->m->size;
    const float *maps = q->m->maps + first * MAP_CHANNELS,
                *colour = maps + (q->which == IO_MAPS_DIFFUSE ? MAP_DIFFUSE : MAP_SPECULAR);
    const float up = q->directx ? -0.5f : 0.5f;
    (void)st;
    if (q->which == IO_MAPS_NORMAL)
        for (size_t i = 0; i < pixels; i++) {
            const io_texel t = io_texel_get(maps + i * MAP_CHANNELS);
            out[3 * i] = t.normal[0] * 0.5f + 0.5f;
            out[3 * i + 1] = t.normal[1] * up + 0.5f;
            out[3 * i + 2] = t.normal[2] * 0.5f + 0.5f;
        }
    else if (q->which == IO_MAPS_ROUGHNESS)
        for (size_t i = 0; i < pixels; i++) out[i] = io_unit(maps[i * MAP_CHANNELS + MAP_ROUGHNESS]);
    else
        for (size_t i = 0; i < pixels; i++)
            for (int c = 0; c < 3; c++) out[3 * i + c] = io_unit(colour[i * MAP_CHANNELS + c]);
    return TS_OK;
}

static ts_code write_map(const char *folder, const char *file, const io_material *m, unsigned which, bool directx,
                         bool half, int threads, ts_status *st)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s/%s", folder, file) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: name too long", folder);
    if (which == IO_MAPS_EXR) return io_write_maps_exr(path, m, directx, half, threads, st);
    bool colour = which == IO_MAPS_DIFFUSE || which == IO_MAPS_SPECULAR;
    map q = {m, which, directx};
    const io_rows rows = {.width = m->size,
                          .height = m->size,
                          .channels = which == IO_MAPS_ROUGHNESS ? 1 : 3,
                          .make = make_rows,
                          .user = &q};
    /* Eight bits of the sRGB curve are enough for albedo; steps of a normal or of roughness are seen in highlights. */
    return io_write_png_rows(path, &rows, colour ? 8 : 16, colour, st);
}

void io_print_conventions(FILE *f, unsigned which, bool directx)
{
    /* With a base colour and a metallic map the reader must not look for F0. */
    if (which & (IO_MAPS_DIFFUSE | IO_MAPS_SPECULAR))
        fputs("workflow: specular (F0)\ndiffuse: sRGB\nspecular: sRGB\n", f);
    fprintf(f, "roughness: linear value, perceptual (alpha = roughness^2)\nnormal: tangent space, %s y\n",
            directx ? "DirectX" : "OpenGL");
}

ts_code io_write_maps_meta(const char *folder, unsigned which, bool directx, ts_status *st)
{
    char path[PATH_MAX];
    io_text text;
    if (snprintf(path, sizeof path, "%s/meta.txt", folder) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: name too long", folder);
    if (io_text_begin(&text, path, st) != TS_OK) return st->code;
    io_print_conventions(text.f, which, directx);
    if (which & IO_MAPS_EXR) fputs("maps.exr: diffuse, specular (F0), roughness and normal, linear\n", text.f);
    return io_text_write(&text, path, st);
}

ts_code io_write_map_files(const char *folder, const io_material *m, unsigned which, bool directx, int threads,
                           ts_status *st)
{
    static const struct {
        unsigned which;
        const char *file;
    } files[] = {{IO_MAPS_DIFFUSE, "diffuse.png"},
                 {IO_MAPS_SPECULAR, "specular.png"},
                 {IO_MAPS_ROUGHNESS, "roughness.png"},
                 {IO_MAPS_NORMAL, "normal.png"},
                 {IO_MAPS_EXR, "maps.exr"}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        if (!(which & files[i].which)) continue;
        ts_code code = write_map(folder, files[i].file, m, files[i].which, directx, which & IO_MAPS_HALF, threads, st);
        if (code != TS_OK) return code;
    }
    return TS_OK;
}

ts_code io_write_maps(const char *folder, const io_material *m, unsigned which, bool directx, ts_status *st)
{
    const ts_code code = io_write_map_files(folder, m, which, directx, 0, st);
    if (code != TS_OK) return code;
    return which ? io_write_maps_meta(folder, which, directx, st) : TS_OK;
}
