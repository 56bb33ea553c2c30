/* A plot as SVG: series of points. */
#ifndef CL_PLOT_H
#define CL_PLOT_H
#include <stdbool.h>
#include <stdio.h>

typedef struct cl_point {
    double x, y;      /* x > 0 on a logarithmic axis */
    double deviation; /* of y: shown when one points at it */
    char label[32];   /* beside the point; may be empty */
} cl_point;

typedef struct cl_series {
    const char *name;
    const cl_point *point;
    int points; /* joined by a line in this order */
    bool level; /* one point, drawn as a line from side to side: it does not depend on x */
} cl_series;

typedef struct cl_axes {
    const char *x_title, *y_title;
    bool log_x;
} cl_axes;

/* A whole <svg> element. Points that are not finite, or whose x is not above 0 on a logarithmic axis, are left out;
 * without any a line says so. */
void cl_plot_write(FILE *f, const cl_axes *axes, const cl_series *series, int count);
#endif
