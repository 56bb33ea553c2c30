/* The step of Gauss and Newton's method in float, with the damping of the shipped models, against the same equations in
 * double, from one photograph and from several, by the equations' steepness, the largest of their diagonal: it is what
 * multiplies rounding where the equations are summed first. */
#include "nn/layers.h"
#include "tensor/cpu.h"
#include "tests/stress/stress.h"
#include "tests/support/normal_equations.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS, REGIONS = 3, MOST = 5 };
static const char *const region_name[REGIONS] = {"steepness <= 100", "steepness <= 1e4", "steeper"};
static const double step_bound[REGIONS] = {1e-5, 1e-4, 5e-4}, loss_bound[REGIONS] = {1e-7, 1e-5, 1e-4};

typedef struct worst {
    double step[REGIONS], loss[REGIONS];
    long pixels[REGIONS], broken;
} worst;

static double log_uniform(ts_rng *rng, double from, double to)
{
    return from * pow(to / from, (double)ts_rng_uniform(rng));
}

/* Roughness 1e-4 .. 1, normals up to the horizon, albedos and F0 0 .. 1, each also exactly at an end. */
static void draw_maps(ts_rng *rng, float maps[C])
{
    for (int i = 0; i < C; i++)
        maps[i] = ts_rng_int(rng, 8) ? ts_rng_range(rng, -1, 1) : (float)(2 * ts_rng_int(rng, 2) - 1);
    maps[MAP_ROUGHNESS] = (float)(2 * log_uniform(rng, 1e-4, 1) - 1);
    const double tilt = ts_rng_int(rng, 2) ? log_uniform(rng, 1e-4, 1) : 1 - log_uniform(rng, 1e-4, 1),
                 phi = 6.2831853 * (double)ts_rng_uniform(rng);
    maps[MAP_NORMAL] = (float)(tilt * cos(phi));
    maps[MAP_NORMAL + 1] = (float)(tilt * sin(phi));
}

static void pixel(ts_rng *rng, int count, worst *w)
{
    const rd_grid grid = {.h = 1, .w = 1, .y0 = ts_rng_int(rng, 8), .x0 = ts_rng_int(rng, 8), .side = 8};
    float maps[C], other[C], step[C], damping[C], value[MOST][3];
    const float *image[MOST];
    rd_view views[MOST];
    double point[2], a[C][C], b[C], gauss[C][C], right[C], x[C];
    draw_maps(rng, maps), draw_maps(rng, other);
    if (ts_rng_int(rng, 2)) /* near what the photographs show, as in refinement, or anywhere */
        for (int i = 0; i < C; i++) other[i] = fminf(fmaxf(maps[i] + ts_rng_range(rng, -0.1f, 0.1f), -1), 1);
    rd_capture_draw(rng, count, views);
    for (int k = 0; k < count; k++) {
        rd_render(grid, other, C, &views[k], true, value[k]);
        image[k] = value[k];
    }
    for (int i = 0; i < C; i++) damping[i] = i >= MAP_SPECULAR ? NN_NEWTON_DAMPING_SPECULAR : NN_NEWTON_DAMPING;
    rd_newton_step(grid, maps, C, views, image, count, damping, step);
    rd_centre(grid, 0, 0, point);
    normal_equations(maps, point, views, image, 0, count, damping, a, b);
    double steepest = 0, best = 0, reached = 0, error = 0;
    bool finite = true, inside = true;
    for (int i = 0; i < C; i++) steepest = fmax(steepest, a[i][i]);
    memcpy(gauss, a, sizeof a), memcpy(right, b, sizeof b);
    normal_solve(gauss, right, x);
    for (int i = 0; i < C; i++) {
        const double at = (double)maps[i], to = at + x[i], clamped = fmin(fmax(to, -1), 1) - at;
        finite = finite && isfinite(step[i]);
        inside = inside && to == clamped + at && fabs(at + (double)step[i]) < 1;
        error = farther(error, fabs((double)step[i] - clamped));
        best += b[i] * x[i] / 2;
        reached += b[i] * (double)step[i];
        for (int j = 0; j < C; j++) reached -= a[i][j] * (double)step[i] * (double)step[j] / 2;
    }
    w->broken += !finite;
    if (!finite) return;
    const int region = steepest <= 100 ? 0 : steepest <= 1e4 ? 1 : 2;
    w->pixels[region]++;
    w->step[region] = fmax(w->step[region], error);
    /* What is missing of the fall of the quadratic that the step minimises; its minimum is known where nothing is
     * clamped. Falls that are rounding are not counted. */
    if (inside && best > 1e-6) w->loss[region] = fmax(w->loss[region], 1 - reached / best);
}

bool stress_newton(const stress *s)
{
    bool ok = true;
    const ts_isa now = ts_isa_now();
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++)
        for (int count = 1; count <= MOST; count += MOST - 1) {
            worst w = {{0}, {0}, {0}, 0};
            char what[128];
            ts_rng rng = ts_rng_make(14, TS_STREAM_TEST, (uint64_t)count);
            ts_isa_use((ts_isa)isa);
            for (int n = 0; n < (s->full ? 400000 : 20000); n++) pixel(&rng, count, &w);
            for (int r = 0; r < REGIONS; r++) {
                snprintf(what, sizeof what, "%s: %d photographs, %s: step (%ld)", ts_isa_name((ts_isa)isa), count,
                         region_name[r], w.pixels[r]);
                ok = stress_row(what, w.step[r], step_bound[r]) && ok;
                snprintf(what, sizeof what, "%s: %d photographs, %s: missing fall", ts_isa_name((ts_isa)isa), count,
                         region_name[r]);
                ok = stress_row(what, w.loss[r], loss_bound[r]) && ok;
                ok = ok && w.pixels[r] > 50; /* a region that nobody met says nothing */
            }
            snprintf(what, sizeof what, "%s: %d photographs, not finite", ts_isa_name((ts_isa)isa), count);
            ok = stress_row(what, (double)w.broken, 0) && ok;
        }
    ts_isa_use(now);
    return ok;
}
