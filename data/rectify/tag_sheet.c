#include "data/rectify/tag_sheet.h"
#include <math.h>
#include <stddef.h>

enum { A_SIDE = 6 }; /* tags, those of the corners with them */

const io_paper io_papers[] = {{"a4", 210, 297}, {"letter", 215.9, 279.4}, {NULL, 0, 0}};

/* k of count places along the square's border, clockwise from the top left corner, the distance from the centre r. */
static void around(int k, int count, double r, double first, double at[2])
{
    const double along = 8 * r * (k + first) / count, rest = fmod(along, 2 * r);
    switch ((int)(along / (2 * r))) {
    case 0: at[0] = -r + rest, at[1] = r; break;
    case 1: at[0] = r, at[1] = r - rest; break;
    case 2: at[0] = r - rest, at[1] = -r; break;
    default: at[0] = -r, at[1] = -r + rest; break;
    }
}

void io_tag_centre(int id, double centre[2])
{
    const double r = IO_SHEET_RING, step = 2 * r / (A_SIDE - 1);
    const int side = id / (A_SIDE - 1);
    const double rest = id % (A_SIDE - 1) * step;
    centre[0] = side == 0 ? -r + rest : side == 1 ? r : side == 2 ? r - rest : -r;
    centre[1] = side == 0 ? r : side == 1 ? r - rest : side == 2 ? -r : -r + rest;
}

void io_tag_corners(int id, double corner[4][2])
{
    const double half = (IO_TAG_CELLS - 2) / 2.0 * IO_TAG_CELL;
    double centre[2];
    io_tag_centre(id, centre);
    for (int k = 0; k < 4; k++) {
        corner[k][0] = centre[0] + (k == 1 || k == 2 ? half : -half);
        corner[k][1] = centre[1] + (k < 2 ? half : -half);
    }
}

void io_sheet_white(int k, double at[2])
{
    enum { RING = 48 };
    if (k < RING) around(k, RING, 63.5 / IO_SHEET_WINDOW, 0.5, at);
    else if (k < 2 * RING) around(k - RING, RING, 95 / IO_SHEET_WINDOW, 0.5, at);
    else around(k - 2 * RING, IO_SHEET_TAGS, IO_SHEET_RING, 0.5, at);
}
