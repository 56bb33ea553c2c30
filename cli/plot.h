/* A plot as SVG: series of points. */
#ifndef EV_PLOT_H
#define EV_PLOT_H
#include <stdbool.h>
#include <stdio.h>

typedef struct ev_point {
    double x, y;      /* x > 0 on a logarithmic axis */
    double deviation; /* of y: shown when one points at it */
    char label[32];   /* beside the point; may be empty */
} ev_point;

typedef struct ev_series {
    const char *name;
    const ev_point *point;
    int points; /* joined by a line in this order */
    bool level; /* one point, drawn as a line from side to side: it does not depend on x */
} ev_series;

typedef struct ev_axes {
    const char *x_title, *y_title;
    bool log_x;
} ev_axes;

/* A whole <svg> element. Points that are not finite, or whose x is not above 0 on a logarithmic axis, are left out;
 * without any a line says so. */
void ev_plot_write(FILE *f, const ev_axes *axes, const ev_series *series, int count);
#endif
