/* How bright the sheet's paper is: the exposure of each photograph, and where the flash is beside the lens. */
#ifndef IO_PAPER_LIGHT_H
#define IO_PAPER_LIGHT_H
#include "data/rectify/pinhole.h"
#include "data/rectify/tag_sheet.h"
#include "data/rectify/warp.h"

typedef struct io_whites {
    double rgb[IO_SHEET_WHITES][3]; /* linear, means over 2 x 2 mm */
    bool good[IO_SHEET_WHITES];     /* in the picture, neither burnt out nor black */
    int count, burnt;               /* good ones; places that are burnt out */
} io_whites;

enum { IO_WHITES_LEAST = 16 };

void io_whites_read(const io_photo_rows *photo, const io_pinhole *camera, io_whites *w);

/* The light of paper at a place, up to its exposure: cos / distance^2 of the light beside the lens, aside to the
 * right and down of it in the camera's frame, in the window's sides. */
double io_paper_light(const io_pinhole *camera, const double aside[2], const double at[2]);

/* The least squares of the logarithms (Huber's, from 5% on) over exposure[k][3], for which paper's rgb is exposure *
 * io_paper_light, and one aside of all photographs, expected within 0.3 sides. Every camera has IO_WHITES_LEAST good
 * places. */
ts_code io_paper_fit(int count, const io_pinhole *camera, const io_whites *whites, double (*exposure)[3],
                     double aside[2], ts_status *st);
#endif
