#include "data/sheet.h"
#include "data/label.h"

enum { PANELS = 5, GAP = 4 };

ts_code io_sheet_create(io_sheet *sheet, int columns, int rows, int size, ts_status *st)
{
    *sheet = (io_sheet){.columns = columns, .rows = rows, .size = size};
    int64_t width = (int64_t)columns * (PANELS * size + GAP) - GAP,
            height = (int64_t)rows * (IO_LABEL_HEIGHT + size + GAP) - GAP;
    if (width * height > IO_MAX_PIXELS_DEFAULT)
        return ts_fail(st, TS_INVALID,
                       "a contact sheet of %lld x %lld pixels is too large: ask for fewer or smaller materials",
                       (long long)width, (long long)height);
    return io_image_create(&sheet->image, (int)width, (int)height, 3, st);
}

void io_sheet_put(io_sheet *sheet, int column, int row, const float *maps, const float *photo)
{
    int size = sheet->size;
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            size_t i = (size_t)y * (size_t)size + (size_t)x;
            io_texel t = io_texel_get(maps + i * MAP_CHANNELS);
            size_t line = (size_t)row * (size_t)(IO_LABEL_HEIGHT + size + GAP) + IO_LABEL_HEIGHT + (size_t)y;
            float *out = sheet->image.data +
                (line * (size_t)sheet->image.width + (size_t)column * (size_t)(PANELS * size + GAP) + (size_t)x) * 3;
            for (int k = 0; k < 3; k++, out++) {
                out[0] = photo[i * 3 + (size_t)k];
                out[3 * size] = io_srgb_to_linear(0.5f + 0.5f * t.normal[k]); /* data, to be seen as its own number */
                out[6 * size] = t.diffuse[k];
                out[9 * size] = io_srgb_to_linear(t.roughness);
                out[12 * size] = t.specular[k];
            }
        }
}

void io_sheet_name(io_sheet *sheet, int row, const char *name)
{
    io_label(&sheet->image, 2, row * (IO_LABEL_HEIGHT + sheet->size + GAP) + 3, name);
}
