#include "data/rectify/paper_light.h"
#include "data/rectify/least_squares.h"
#include <math.h>
#include <stdlib.h>

#define BURNT 0.97
#define BLACK 0.004 /* an 8-bit code is 8% of it */
#define HUBER 0.05
#define ASIDE 0.3

void io_whites_read(const io_photo_rows *photo, const io_pinhole *camera, io_whites *w)
{
    enum { POINTS = 5 };
    *w = (io_whites){.count = 0};
    for (int k = 0; k < IO_SHEET_WHITES; k++) {
        double at[2], most = 0, least = 1;
        bool inside = true;
        io_sheet_white(k, at);
        for (int i = 0; i < POINTS * POINTS; i++) {
            const double point[2] = {at[0] + (i % POINTS - 2) * 0.5 / IO_SHEET_WINDOW,
                                     at[1] + (i / POINTS - 2) * 0.5 / IO_SHEET_WINDOW};
            double pixel[2];
            float rgb[3];
            inside = inside && io_pinhole_see(camera, point, pixel) && pixel[0] >= 0 && pixel[1] >= 0 &&
                pixel[0] <= photo->width && pixel[1] <= photo->height;
            if (!inside) break;
            io_photo_at(photo, pixel, rgb);
            for (int c = 0; c < 3; c++) {
                w->rgb[k][c] += (double)rgb[c] / (POINTS * POINTS);
                most = fmax(most, (double)rgb[c]);
                least = fmin(least, (double)rgb[c]);
            }
        }
        w->good[k] = inside && most < BURNT && least > BLACK;
        w->count += w->good[k];
        w->burnt += inside && most >= BURNT;
    }
}

double io_paper_light(const io_pinhole *camera, const double aside[2], const double at[2])
{
    double d[3], distance2 = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = camera->at[k] + aside[0] * camera->rotation[0][k] + aside[1] * camera->rotation[1][k] -
            (k < 2 ? at[k] : 0);
        distance2 += d[k] * d[k];
    }
    return fmax(d[2], 1e-6) / (distance2 * sqrt(distance2));
}

typedef struct fit {
    int count;
    const io_pinhole *camera;
    const io_whites *whites;
} fit;

static double luma(const double rgb[3]) { return 0.25 * rgb[0] + 0.5 * rgb[1] + 0.25 * rgb[2]; }

/* x: aside, then the logarithm of each exposure. */
static void residuals(const double *x, double *residual, void *user)
{
    const fit *f = user;
    for (int k = 0; k < 2; k++) *residual++ = x[k] / ASIDE;
    for (int i = 0; i < f->count; i++)
        for (int k = 0; k < IO_SHEET_WHITES; k++) {
            if (!f->whites[i].good[k]) continue;
            double at[2];
            io_sheet_white(k, at);
            const double r = (log(luma(f->whites[i].rgb[k]) / io_paper_light(&f->camera[i], x, at)) - x[2 + i]) / HUBER;
            const double size = fabs(r);
            *residual++ = size <= 1 ? r : copysign(sqrt(2 * size - 1), r);
        }
}

/* Each colour's exposure from the luma's. */
static void split(const io_whites *w, double exposure, double rgb[3])
{
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int k = 0; k < IO_SHEET_WHITES; k++)
            if (w->good[k]) sum += log(w->rgb[k][c] / luma(w->rgb[k]));
        rgb[c] = exp(exposure + sum / w->count);
    }
}

ts_code io_paper_fit(int count, const io_pinhole *camera, const io_whites *whites, double (*exposure)[3],
                     double aside[2], ts_status *st)
{
    const double none[2] = {0};
    fit f = {count, camera, whites};
    io_problem p = {2 + count, 2, NULL, residuals, &f};
    double *x = calloc(2 * (size_t)p.n, sizeof *x), *step = x + p.n;
    if (!x) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", count);
    for (int j = 0; j < p.n; j++) step[j] = 1e-5;
    for (int i = 0; i < count; i++) {
        p.count += whites[i].count;
        for (int k = 0; k < IO_SHEET_WHITES; k++) {
            double at[2];
            io_sheet_white(k, at);
            if (whites[i].good[k])
                x[2 + i] += log(luma(whites[i].rgb[k]) / io_paper_light(&camera[i], none, at)) / whites[i].count;
        }
    }
    p.step = step;
    const ts_code code = io_least_squares(&p, x, NULL, st);
    for (int k = 0; k < 2; k++) aside[k] = x[k];
    for (int i = 0; i < count && !code; i++) split(&whites[i], x[2 + i], exposure[i]);
    free(x);
    return code;
}
