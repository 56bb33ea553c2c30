/* A contact sheet: one cell for each material, with its photograph, normals, diffuse colour, roughness and specular
 * colour side by side. */
#ifndef IO_SHEET_H
#define IO_SHEET_H
#include "data/material.h"

typedef struct io_sheet {
    int columns, rows, size;
    io_image image; /* linear: what io_write_png(…, srgb) shows as intended */
} io_sheet;

/* size: of one panel. Owns its image; io_image_free(&sheet->image) frees it. */
ts_code io_sheet_create(io_sheet *sheet, int columns, int rows, int size, ts_status *st);
/* maps: [size][size][9]; photo: [size][size][3], linear. Cells may be filled from several threads. */
void io_sheet_name(io_sheet *sheet, int row, const char *name); /* above the row, as io_label writes it */
void io_sheet_put(io_sheet *sheet, int column, int row, const float *maps, const float *photo);
#endif
