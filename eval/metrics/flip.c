#include "eval/metrics/flip.h"
#include "tensor/team.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* Planes of one picture. */
typedef struct side {
    double *colour[3];  /* Y Cx Cz, then filtered, then Hunt-adjusted L*a*b* */
    double *edge, *dot; /* magnitudes of the two derivatives of Y */
} side;

enum { STEP = 256 }; /* pixels at a time, at least */
enum { SIDE_PLANES = 5, WORK_PLANES = 3, PLANES = 2 * SIDE_PLANES + WORK_PLANES };

static double clamp(double v) { return v > 0 ? v < 1 ? v : 1 : 0; } /* NaN: 0 */

static void magnitude(int h, int w, const double *y, bool point, double *work[WORK_PLANES], double *out)
{
    ev_taps derivative, smooth;
    ev_flip_feature(point, &derivative, &smooth);
    ev_filter(h, w, y, &derivative, &smooth, work[0], work[1]);
    ev_filter(h, w, y, &smooth, &derivative, work[0], out);
    const int64_t pixels = (int64_t)h * w;
    for (int64_t i = 0; i < pixels; i++) out[i] = sqrt(work[1][i] * work[1][i] + out[i] * out[i]);
}

static void hunt(const void *job, int64_t begin, int64_t end)
{
    const side *s = job;
    for (int64_t i = begin; i < end; i++) {
        const double ycc[3] = {s->colour[0][i], s->colour[1][i], s->colour[2][i]};
        double rgb[3], lab[3];
        ev_flip_rgb(ycc, rgb);
        for (int c = 0; c < 3; c++) rgb[c] = clamp(rgb[c]);
        ev_flip_lab(rgb, lab);
        ev_flip_hunt(lab);
        for (int c = 0; c < 3; c++) s->colour[c][i] = lab[c];
    }
}

static void prepare(int h, int w, const float *picture, const side *s, double *work[WORK_PLANES])
{
    const int64_t pixels = (int64_t)h * w;
    for (int64_t i = 0; i < pixels; i++) {
        const double rgb[3] = {clamp((double)picture[3 * i]), clamp((double)picture[3 * i + 1]),
                               clamp((double)picture[3 * i + 2])};
        double ycc[3];
        ev_flip_ycxcz(rgb, ycc);
        for (int c = 0; c < 3; c++) s->colour[c][i] = ycc[c];
        work[2][i] = (ycc[0] + 16) / 116;
    }
    magnitude(h, w, work[2], false, work, s->edge);
    magnitude(h, w, work[2], true, work, s->dot);
    for (int c = 0; c < 3; c++) {
        double weight[2];
        ev_taps taps[2];
        const int terms = ev_flip_csf(c, weight, taps);
        for (int k = 0; k < terms; k++) ev_filter(h, w, s->colour[c], &taps[k], &taps[k], work[0], work[1 + k]);
        for (int64_t i = 0; i < pixels; i++)
            s->colour[c][i] = weight[0] * work[1][i] + (terms > 1 ? weight[1] * work[2][i] : 0);
    }
    ts_for(0, pixels, STEP, hunt, s);
}

typedef struct comparison {
    const side *a, *b;
    double largest, *error;
} comparison;

static void compare(const void *job, int64_t begin, int64_t end)
{
    const comparison *c = job;
    const side *a = c->a, *b = c->b;
    for (int64_t i = begin; i < end; i++) {
        const double p[3] = {a->colour[0][i], a->colour[1][i], a->colour[2][i]},
                     q[3] = {b->colour[0][i], b->colour[1][i], b->colour[2][i]};
        const double colour = ev_flip_colour(ev_flip_hyab(p, q), c->largest);
        const double feature = sqrt(fmax(fabs(a->edge[i] - b->edge[i]), fabs(a->dot[i] - b->dot[i])) / sqrt(2));
        c->error[i] = pow(colour, 1 - fmin(feature, 1)); /* equation 9 */
    }
}

double ev_flip(int h, int w, const float *test, const float *reference, float *map)
{
    const size_t pixels = (size_t)h * (size_t)w;
    double *memory = malloc(PLANES * pixels * sizeof *memory), *work[WORK_PLANES], *next = memory;
    side a, b;
    if (!memory) return NAN;
    for (int k = 0; k < WORK_PLANES; k++, next += pixels) work[k] = next;
    for (int p = 0; p < 2; p++) {
        side *s = p ? &b : &a;
        for (int c = 0; c < 3; c++, next += pixels) s->colour[c] = next;
        s->edge = next;
        s->dot = next + pixels;
        next += 2 * pixels;
    }
    prepare(h, w, test, &a, work);
    prepare(h, w, reference, &b, work);
    double *error = work[0], sum = 0;
    ts_for(0, (int64_t)pixels, STEP, compare, &(comparison){&a, &b, ev_flip_largest(), error});
    for (int y = 0; y < h; y++) {
        double row = 0;
        for (int x = 0; x < w; x++) {
            const size_t i = (size_t)y * (size_t)w + (size_t)x;
            row += error[i];
            if (map) map[i] = (float)error[i];
        }
        sum += row;
    }
    free(memory);
    return sum / (double)pixels;
}
