#include "eval/sheet.h"
#include "eval/multiview.h"
#include "infer/panels.h"
#include "render/render.h"
#include "tensor/resize.h"
#include <math.h>
#include <stdio.h>

enum { ROWS = 3, RENDERINGS = 3, COLUMNS = 1 + LGD_MAP_PANELS + RENDERINGS, PHOTO_COLUMNS = 1 + LGD_MAP_PANELS + 1 };

static bool only_photo(const ev_case *c) { return !c->capture && !c->truth; }

static int columns_of(const ev_case *c)
{
    if (only_photo(c)) return PHOTO_COLUMNS;
    return c->capture && c->capture->images < COLUMNS ? c->capture->images : COLUMNS;
}

/* maps NULL: the photographs. Each estimate has its own exposure. */
static void capture_row(io_image *sheet, const ev_case *c, int row, const float *maps, float *picture)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    const double exposure = maps
        ? ev_capture_score(c->capture, c->inputs, maps, MAP_CHANNELS, false, NULL).value[EV_EXPOSURE]
        : 1;
    for (int i = 0; i < columns_of(c); i++) {
        if (maps) ev_capture_render(c->capture, i, maps, MAP_CHANNELS, exposure, picture);
        lgd_panel_put(sheet, c->size, i, row, maps ? picture : c->capture->image + (size_t)i * values);
    }
}

/* maps NULL: the truth. */
static void maps_row(io_image *sheet, const ev_case *c, int row, const float *maps, float *picture)
{
    const io_material m = {.size = c->size, .maps = maps ? (float *)maps : c->truth->maps}; /* only read */
    if (maps) lgd_panel_render(sheet, 0, row, &m, &c->view, picture);
    else lgd_panel_put(sheet, c->size, 0, row, c->image);
    lgd_panel_maps(sheet, 1, row, &m, picture);
    for (int i = 0; i < RENDERINGS; i++)
        lgd_panel_render(sheet, 1 + LGD_MAP_PANELS + i, row, &m, &c->views[i], picture);
}

/* Under the light that the method found, c->view, and as bright as the photograph. */
static void photo_row(io_image *sheet, const ev_case *c, int row, const float *maps, float *picture)
{
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    const io_material m = {.size = c->size, .maps = (float *)maps}; /* only read */
    lgd_panel_put(sheet, c->size, 0, row, c->image);
    lgd_panel_maps(sheet, 1, row, &m, picture);
    rd_render(rd_grid_full(c->size), maps, MAP_CHANNELS, &c->view, false, picture);
    const float factor = (float)ev_factor(values, picture, c->image);
    for (size_t i = 0; i < values; i++) picture[i] *= factor;
    lgd_panel_put(sheet, c->size, 1 + LGD_MAP_PANELS, row, picture);
}

/* Row i shows maps[i]; the sheet has rows of them and is linear. */
static ts_code make(const ev_case *c, const float *const *maps, int rows, int sheet_rows, io_image *sheet,
                    ts_status *st)
{
    io_image picture = {0};
    ts_code code = io_image_create(sheet, columns_of(c) * c->size, sheet_rows * c->size, 3, st);
    if (!code) code = io_image_create(&picture, c->size, c->size, 3, st);
    for (int row = 0; row < rows && !code; row++)
        (c->capture ? capture_row : only_photo(c) ? photo_row : maps_row)(sheet, c, row, maps[row], picture.data);
    io_image_free(&picture);
    return code;
}

/* The rows of a whole sheet; how many. A photograph has no truth, and its first estimate says little. */
static int rows_of(const ev_case *c, const float *first, const float *last, const float *maps[ROWS + 1])
{
    int rows = 0;
    if (!only_photo(c)) maps[rows++] = NULL, maps[rows++] = first;
    maps[rows++] = last;
    if (c->peer) maps[rows++] = c->peer->maps;
    return rows;
}

ts_code ev_sheet_write(const char *path, const ev_case *c, const float *first, const float *last, ts_status *st)
{
    const float *maps[ROWS + 1];
    const int rows = rows_of(c, first, last, maps);
    io_image sheet = {0};
    ts_code code = make(c, maps, rows, rows, &sheet, st);
    if (!code) code = io_write_png(path, &sheet, 8, true, st);
    io_image_free(&sheet);
    return code;
}

ev_sheet_shape ev_sheet_shape_of(const ev_case *c)
{
    if (only_photo(c)) return (ev_sheet_shape){EV_SHEET_ALONE, columns_of(c), c->peer ? 2 : 1, 1};
    return (ev_sheet_shape){c->capture ? EV_SHEET_CAPTURE : EV_SHEET_MAPS, columns_of(c), ROWS, c->inputs};
}

const char *ev_sheet_column(const ev_sheet_shape *shape, int column, char label[EV_SHEET_LABEL])
{
    static const char *const maps[] = {"diffuse", "specular", "roughness", "normal"};
    if (shape->kind == EV_SHEET_CAPTURE)
        snprintf(label, EV_SHEET_LABEL, "photo %d%s", column + 1, column < shape->inputs ? ", input" : "");
    else if (column == 0) return shape->kind == EV_SHEET_ALONE ? "photograph" : "flash picture";
    else if (column <= LGD_MAP_PANELS) return maps[column - 1];
    else if (shape->kind == EV_SHEET_ALONE) return "rendered, as bright";
    else snprintf(label, EV_SHEET_LABEL, "rendering %d", column - LGD_MAP_PANELS);
    return label;
}

const char *ev_sheet_row(const ev_sheet_shape *shape, int row)
{
    static const char *const compared[] = {"truth", "estimate", "difference, \303\2274"},
                             *const alone[] = {"estimate", "peer"};
    if (shape->kind == EV_SHEET_CAPTURE && row == 0) return "photograph";
    return shape->kind == EV_SHEET_ALONE ? alone[row] : compared[row];
}

/* The third row from the first two, as they are shown. */
static void difference_row(io_image *sheet)
{
    const size_t values = (size_t)sheet->width * (size_t)sheet->height; /* a third of the height times three channels */
    for (size_t i = 0; i < values; i++) {
        const float d = fabsf(io_linear_to_srgb(sheet->data[i]) - io_linear_to_srgb(sheet->data[values + i]));
        sheet->data[2 * values + i] = io_srgb_to_linear(fminf(4 * d, 1));
    }
}

static ts_code shrink(io_image *sheet, int width, int height, ts_status *st)
{
    io_image small = {0};
    ts_arena *arena = ts_arena_create(0, st);
    ts_code code = arena ? io_image_create(&small, width, height, 3, st) : st->code;
    if (!code) {
        const ts_tensor from = ts_view(sheet->data, (ts_shape){1, sheet->height, sheet->width, 3});
        ts_tensor to = ts_view(small.data, (ts_shape){1, height, width, 3});
        code = ts_resize(&to, &from, arena, 0, st);
    }
    ts_arena_destroy(&arena);
    io_image_free(code ? &small : sheet);
    if (!code) *sheet = small;
    return code;
}

ts_code ev_sheet_small(const ev_case *c, const float *estimate, io_image *sheet, ts_status *st)
{
    const float *maps[ROWS + 1] = {NULL, estimate};
    const bool alone = only_photo(c);
    const int filled = alone ? rows_of(c, NULL, estimate, maps) : 2, rows = alone ? filled : ROWS,
              panel = alone ? EV_SHEET_PHOTO : EV_SHEET_PANEL;
    *sheet = (io_image){0};
    ts_code code = make(c, maps, filled, rows, sheet, st);
    if (!code && !alone) difference_row(sheet);
    if (!code && c->size > panel) code = shrink(sheet, columns_of(c) * panel, rows * panel, st);
    if (code) io_image_free(sheet);
    return code;
}

ts_code ev_sheet_png(const ev_case *c, const float *estimate, unsigned char **bytes, size_t *size, ts_status *st)
{
    io_image sheet;
    *bytes = NULL;
    ts_code code = ev_sheet_small(c, estimate, &sheet, st);
    if (!code) code = io_png_bytes(&sheet, 8, true, bytes, size, st);
    io_image_free(&sheet);
    return code;
}
