/* A picture of one material's truth and estimates. */
#ifndef EV_SHEET_H
#define EV_SHEET_H
#include "eval/metrics/metrics.h"

/* Three rows (truth, R_0, the last R_t), and one of a peer's maps where there are any, each: flash picture, diffuse,
 * specular, roughness, normal, three of the evaluation's renderings. The truth's flash picture is the input as the
 * network saw it. Of a capture: its first eight photographs and their re-renderings. Of a photograph without known maps
 * a row of the last estimate, and the peer's: the photograph, its maps, the re-rendering as bright as the photograph.
 * Written as an 8-bit sRGB PNG. */
ts_code ev_sheet_write(const char *path, const ev_case *c, const float *first, const float *last, ts_status *st);

/* What the panels of the report's picture are. */
typedef enum ev_sheet_kind { EV_SHEET_MAPS, EV_SHEET_CAPTURE, EV_SHEET_ALONE } ev_sheet_kind;
typedef struct ev_sheet_shape {
    ev_sheet_kind kind; /* known maps, a capture, or a photograph alone */
    int columns, rows;
    int inputs; /* of a capture: the first columns, which the method has seen */
} ev_sheet_shape;
ev_sheet_shape ev_sheet_shape_of(const ev_case *c);
/* What a column and a row show, in plain words. */
enum { EV_SHEET_LABEL = 40 };
const char *ev_sheet_column(const ev_sheet_shape *shape, int column, char label[EV_SHEET_LABEL]);
const char *ev_sheet_row(const ev_sheet_shape *shape, int row);

/* The same columns for the report, panels of at most EV_SHEET_PANEL pixels: truth, estimate, and four times the
 * difference of the two; of a photograph the rows of its sheet, panels of at most EV_SHEET_PHOTO pixels. Linear. */
enum { EV_SHEET_PANEL = 96, EV_SHEET_PHOTO = 128 };
ts_code ev_sheet_small(const ev_case *c, const float *maps, io_image *sheet, ts_status *st);
/* bytes of a PNG of it, malloced and the caller's. */
ts_code ev_sheet_png(const ev_case *c, const float *maps, unsigned char **bytes, size_t *size, ts_status *st);
#endif
