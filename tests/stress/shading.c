/* The kernels in float against the double reference over a grid of roughness, angles, albedos and tilts. */
#include "render/brdf.h"
#include "render/kernels/shade.h"
#include "render/render.h"
#include "render/rows.h"
#include "tensor/cpu.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS, REGIONS = 4 };
static const char *const region_name[REGIONS] = {"roughness >= 0.02, |n_xy| <= 0.999, angles <= 89", "roughness < 0.02",
                                                 "|n_xy| > 0.999", "angles > 89"};

typedef struct worst {
    double value[REGIONS], gradient[REGIONS];
    long pixels[REGIONS], seen, broken; /* broken: not finite */
} worst;

static double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static int region_of(const double m[C], const rd_surface *s, const double l[3], const double v[3])
{
    if (m[MAP_ROUGHNESS] / 2 + 0.5 < 0.02) return 1;
    if (hypot(m[MAP_NORMAL], m[MAP_NORMAL + 1]) > 0.999) return 2;
    const double least = cos(89 * 3.14159265358979323846 / 180);
    return dot3(s->n, l) < least || dot3(s->n, v) < least ? 3 : 0;
}

/* The largest difference in each kind of map, relative to that kind's largest derivative, or, since those by roughness
 * and F0 pass through zero while their terms do not, to a tenth of the terms: value, and for roughness value times 2 /
 * roughness (D's derivative is the difference of two such, equal where the normal is about alpha off the half vector).
 */
static double gradient_error(const float *a, const double *b, double value, double roughness)
{
    static const int first[] = {MAP_DIFFUSE, MAP_NORMAL, MAP_ROUGHNESS, MAP_SPECULAR, C};
    double most = 0;
    for (int k = 0; k < 4; k++) {
        double error = 0, scale = 0.1 * value * (k == 2 ? fmax(1, 2 / roughness) : 1);
        for (int i = first[k]; i < first[k + 1]; i++) {
            error = farther(error, fabs((double)a[i] - b[i]));
            scale = farther(scale, fabs(b[i]));
        }
        if (scale > 0) most = fmax(most, error / scale);
    }
    return most;
}

static void pixel(const float *maps, const rd_view *view, rd_grid grid, worst *w)
{
    double m[C], point[2], l[3], v[3], value[3], by[3][C];
    float image[3], base[3], gradient[C];
    rd_surface s;
    for (int i = 0; i < C; i++) m[i] = (double)maps[i];
    rd_centre(grid, 0, 0, point);
    rd_light(view, point, l, v);
    rd_decode_double(m, &s);
    rd_radiance(m, point, view, value, by);
    rd_render(grid, maps, C, view, false, image);
    /* A weak light, so that nothing is clamped, and a photograph that is darker by one in green: the gradient is then
     * radiance's own. */
    rd_view weak = *view;
    weak.power *= 1e-12f; /* radiance reaches 1e9 */
    rd_render(grid, maps, C, &weak, false, base);
    base[1] -= 1;
    const ts_shade_view sv = rd_shade_view(&weak);
    const ts_shade_row row = rd_shade_row(grid, 0, maps, C);
    ts_shade_k()->flash(&sv, &row, base, 1e12f, gradient);
    bool finite = true;
    for (int c = 0; c < 3; c++) finite = finite && isfinite(image[c]);
    for (int i = 0; i < C; i++) finite = finite && isfinite(gradient[i]);
    w->broken += !finite;
    w->seen++;
    const int region = region_of(m, &s, l, v);
    if (!finite || !(value[0] > 0)) return; /* not seen, and so told by both: no relative error */
    w->pixels[region]++;
    for (int c = 0; c < 3; c++)
        w->value[region] = farther(w->value[region], fabs((double)image[c] - value[c]) / value[c]);
    w->gradient[region] = fmax(w->gradient[region], gradient_error(gradient, by[1], value[1], s.roughness));
}

static void grid_of(bool full, worst *w)
{
    static const double roughness[] = {1e-4, 1e-3, 0.0101, 0.0201, 0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1};
    static const double angle[] = {0, 1e-3, 0.1, 1, 10, 30, 45, 60, 75, 85, 88.9, 89.5, 89.9};
    static const double albedo[] = {0, 1e-3, 0.04, 0.5, 1};
    static const double tilt[] = {0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99, 0.9989, 0.9999, 1};
    const double degree = 3.14159265358979323846 / 180;
    const int stride = full ? 1 : 3;
    const rd_grid grid = {.h = 1, .w = 1, .y0 = 2, .x0 = 3, .side = 8};
    double point[2];
    rd_centre(grid, 0, 0, point);
    for (size_t r = 0; r < sizeof roughness / sizeof *roughness; r++)
        for (size_t a = 0; a < sizeof angle / sizeof *angle; a++)
            for (size_t b = 0; b < sizeof angle / sizeof *angle; b++)
                for (size_t n = 0; n < sizeof tilt / sizeof *tilt; n++)
                    for (int turn = 0; turn < 6; turn += stride) {
                        /* the light at angle a from the sample's normal, the camera at b, the normal tilted, all in
                         * other directions */
                        const double pl = 0.3 + turn, pv = turn < 3 ? pl + 180 * degree : pl + 1.1 * turn,
                                     pn = pl + 0.9 * turn;
                        const size_t k = (r + a + b + n + (size_t)turn) % (sizeof albedo / sizeof *albedo);
                        rd_view view = {.kind = RD_POINT, .power = 3};
                        const double tl = angle[a] * degree, tv = angle[b] * degree;
                        const double l[3] = {sin(tl) * cos(pl), sin(tl) * sin(pl), cos(tl)},
                                     v[3] = {sin(tv) * cos(pv), sin(tv) * sin(pv), cos(tv)};
                        for (int i = 0; i < 3; i++) {
                            view.light[i] = (float)(l[i] + (i < 2 ? point[i] : 0));
                            view.camera[i] = (float)(v[i] + (i < 2 ? point[i] : 0));
                        }
                        float maps[C];
                        for (int i = 0; i < 3; i++) {
                            maps[MAP_DIFFUSE + i] = (float)(2 * albedo[k] - 1);
                            maps[MAP_SPECULAR + i] = (float)(2 * albedo[(k + r + n) % 5] - 1);
                        }
                        maps[MAP_ROUGHNESS] = (float)(2 * roughness[r] - 1);
                        maps[MAP_NORMAL] = (float)(tilt[n] * cos(pn));
                        maps[MAP_NORMAL + 1] = (float)(tilt[n] * sin(pn));
                        pixel(maps, &view, grid, w);
                        /* and a normal within a few widths of the highlight, which the grid would hardly meet */
                        const double alpha = roughness[r] * roughness[r],
                                     h[3] = {l[0] + v[0], l[1] + v[1], l[2] + v[2]}, length = sqrt(dot3(h, h));
                        maps[MAP_NORMAL] = (float)(h[0] / length + alpha * tilt[n] * cos(pn));
                        maps[MAP_NORMAL + 1] = (float)(h[1] / length + alpha * tilt[n] * sin(pn));
                        pixel(maps, &view, grid, w);
                    }
}

bool stress_shading(const stress *s)
{
    bool ok = true;
    const ts_isa now = ts_isa_now();
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        worst w = {{0}, {0}, {0}, 0, 0};
        char what[128];
        ts_isa_use((ts_isa)isa);
        grid_of(s->full, &w);
        for (int r = 0; r < REGIONS; r++) {
            snprintf(what, sizeof what, "%s: %s: value (%ld)", ts_isa_name((ts_isa)isa), region_name[r], w.pixels[r]);
            ok = stress_row(what, w.value[r], r ? INFINITY : 1e-5) && ok;
            snprintf(what, sizeof what, "%s: %s: gradient", ts_isa_name((ts_isa)isa), region_name[r]);
            ok = stress_row(what, w.gradient[r], r ? INFINITY : 1e-4) && ok;
            ok = ok && w.pixels[r] > 50; /* a region that nobody met says nothing */
        }
        snprintf(what, sizeof what, "%s: not finite, of %ld", ts_isa_name((ts_isa)isa), w.seen);
        ok = stress_row(what, (double)w.broken, 0) && ok;
    }
    ts_isa_use(now);
    return ok;
}
