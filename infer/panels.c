#include "infer/panels.h"
#include "render/render.h"
#include <math.h>
#include <string.h>

void lgd_panel_put(io_image *sheet, int size, int column, int row, const float *picture)
{
    for (int y = 0; y < size; y++) {
        float *to = sheet->data + ((size_t)(row * size + y) * (size_t)sheet->width + (size_t)column * (size_t)size) * 3;
        const float *from = picture + (size_t)y * (size_t)size * 3;
        for (int i = 0; i < size * 3; i++) to[i] = fminf(fmaxf(from[i], 0), 1);
    }
}

void lgd_panel_render(io_image *sheet, int column, int row, const io_material *m, const rd_view *view, float *picture)
{
    rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, view, true, picture);
    lgd_panel_put(sheet, m->size, column, row, picture);
}

void lgd_panel_maps(io_image *sheet, int column, int row, const io_material *m, float *picture)
{
    const int64_t pixels = (int64_t)m->size * m->size;
    for (int panel = 0; panel < LGD_MAP_PANELS; panel++) {
        for (int64_t i = 0; i < pixels; i++) {
            const io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
            for (int c = 0; c < 3; c++) {
                const float v[LGD_MAP_PANELS] = {t.diffuse[c], t.specular[c], io_srgb_to_linear(t.roughness),
                                                 io_srgb_to_linear(0.5f * t.normal[c] + 0.5f)};
                picture[3 * i + c] = v[panel];
            }
        }
        lgd_panel_put(sheet, m->size, column + panel, row, picture);
    }
}
