#include "eval/sheet.h"
#include "eval/multiview.h"
#include "infer/panels.h"

enum { ROWS = 3, RENDERINGS = 3, COLUMNS = 1 + LGD_MAP_PANELS + RENDERINGS };

/* Rows: the photographs, and their re-renderings by R_0 and the last R_t, each with its own exposure. */
static ts_code capture_sheet(const char *path, const ev_case *c, const float *first, const float *last, ts_status *st)
{
    const io_capture *capture = c->capture;
    const int size = c->size, columns = capture->images < COLUMNS ? capture->images : COLUMNS;
    const size_t values = (size_t)size * (size_t)size * 3;
    io_image sheet = {0}, picture = {0};
    ts_code code = io_image_create(&sheet, columns * size, ROWS * size, 3, st);
    if (!code) code = io_image_create(&picture, size, size, 3, st);
    for (int row = 0; row < ROWS && !code; row++) {
        const float *maps = row == 1 ? first : last;
        const double exposure = row ? ev_capture_score(capture, maps, MAP_CHANNELS, false).value[EV_EXPOSURE] : 1;
        for (int i = 0; i < columns; i++) {
            if (row) ev_capture_render(capture, i, maps, MAP_CHANNELS, exposure, picture.data);
            lgd_panel_put(&sheet, size, i, row, row ? picture.data : capture->image + (size_t)i * values);
        }
    }
    if (!code) code = io_write_png(path, &sheet, 8, true, st);
    io_image_free(&sheet);
    io_image_free(&picture);
    return code;
}

ts_code ev_sheet_write(const char *path, const ev_case *c, const float *first, const float *last, ts_status *st)
{
    if (c->capture) return capture_sheet(path, c, first, last, st);
    const int size = c->size;
    io_image sheet = {0}, picture = {0};
    ts_code code = io_image_create(&sheet, COLUMNS * size, ROWS * size, 3, st);
    if (!code) code = io_image_create(&picture, size, size, 3, st);
    for (int row = 0; row < ROWS && !code; row++) {
        const float *const maps[ROWS] = {c->truth->maps, first, last};
        const io_material m = {.size = size, .maps = (float *)maps[row]}; /* only read */
        const rd_view flash = rd_flash();
        if (row == 0) lgd_panel_put(&sheet, size, 0, 0, c->image);
        else lgd_panel_render(&sheet, 0, row, &m, &flash, picture.data);
        lgd_panel_maps(&sheet, 1, row, &m, picture.data);
        for (int i = 0; i < RENDERINGS; i++) lgd_panel_render(&sheet, 1 + LGD_MAP_PANELS + i, row, &m, &c->views[i], picture.data);
    }
    if (!code) code = io_write_png(path, &sheet, 8, true, st);
    io_image_free(&sheet);
    io_image_free(&picture);
    return code;
}
