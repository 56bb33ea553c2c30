/* The printed sheet: a window, through which the sample is seen, framed by AprilTags of the family 36h11 (Wang and
 * Olson, "AprilTag 2: Efficient and robust fiducial detection", 2016). The window is the sample's square: positions are
 * in its sides (120 mm when printed at full size, but nothing depends on that), x right, y up, from its centre. */
#ifndef IO_TAG_SHEET_H
#define IO_TAG_SHEET_H
#include "tensor/status.h"
#include <stdbool.h>

enum { IO_SHEET_TAGS = 20, IO_TAG_CELLS = 10 /* a side, the white border of one cell with them */ };
#define IO_SHEET_WINDOW 120.0                  /* mm */
#define IO_TAG_CELL (2.5 / IO_SHEET_WINDOW)    /* side of a cell */
#define IO_SHEET_RING (76.5 / IO_SHEET_WINDOW) /* the tags' centres lie on a square of twice this side */
#define IO_SHEET_PAPER 0.8                     /* albedo that the paper counts with: of office paper, .75 to .85 */

/* The centre of tag number id, 0 .. IO_SHEET_TAGS - 1: clockwise from the top left corner. */
void io_tag_centre(int id, double centre[2]);
/* The corners of its black square: top left, top right, bottom right, bottom left. */
void io_tag_corners(int id, double corner[4][2]);

/* Places where the sheet is white: around the window, between the tags, outside of them. */
enum { IO_SHEET_WHITES = 116 };
void io_sheet_white(int k, double at[2]);

/* The sheets' paper, mm. */
typedef struct io_paper {
    const char *name;
    double width, height;
} io_paper;
extern const io_paper io_papers[]; /* ends with name NULL */

/* black[tag][row][column] of every tag, top row first. TS_UNSUPPORTED with a line that says what to install where the
 * program was built without libapriltag. */
typedef bool io_tag_image[IO_TAG_CELLS][IO_TAG_CELLS];
ts_code io_tag_images(io_tag_image black[IO_SHEET_TAGS], ts_status *st);

/* Writes the sheet as a drawing: PDF, or SVG where the file's name ends so. TS_INVALID for another name. */
ts_code io_sheet_print(const char *path, const io_paper *paper, ts_status *st);
#endif
