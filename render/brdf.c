#include "render/brdf.h"
#include "render/published.h"
#include <math.h>

const ts_shade_guards rd_guards = {
    /* alpha = 1e-4: such a highlight is 2e-4 patch widths across, less than a pixel up to 4096, so that nothing sharper
     * differs from it; and 1 / alpha^2, which D and its derivatives contain twice, stays far inside float. */
    .roughness = 0.01,
    /* As published. d n_z / d n_x = -n_x / n_z is at most 1000, instead of infinite where |n_xy| reaches 1. */
    .nz2 = 1e-6,
    /* 1e-4 patch widths, a tenth of a pixel at 1024: only a light inside the surface is nearer. */
    .distance2 = 1e-8,
    /* As published: a light in the plane of the sample would be divided by 0. */
    .lz = 0.001,
};

#define PI 3.14159265358979323846

double rd_alpha(double roughness) { return TS_ALPHA(roughness); }

static double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Also |n x h|^2, which keeps its relative accuracy where 1 - (n.h)^2 has none left. */
static double cross2(const double a[3], const double b[3])
{
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    return x * x + y * y + z * z;
}

/* The zero vector stays zero. */
static double normalize3(double a[3])
{
    double length = sqrt(dot3(a, a));
    for (int i = 0; i < 3; i++) a[i] = length > 0 ? a[i] / length : 0;
    return length;
}

static const ts_shade_guards *guards_of(const rd_view *view)
{
    return view->kind == RD_PUBLISHED ? &rd_published.guards : &rd_guards;
}

static void decode(const ts_shade_guards *guards, const double maps[MAP_CHANNELS], rd_surface *s)
{
    double x[MAP_CHANNELS];
    for (int i = 0; i < MAP_CHANNELS; i++) {
        bool inside = maps[i] >= -1 && maps[i] <= 1;
        x[i] = inside ? maps[i] : maps[i] > 1 ? 1 : -1; /* NaN becomes -1 */
        s->slope[i] = !inside ? 0 : i == MAP_NORMAL || i == MAP_NORMAL + 1 ? 1 : 0.5;
    }
    for (int c = 0; c < 3; c++) {
        s->diffuse[c] = (x[MAP_DIFFUSE + c] + 1) / 2;
        s->specular[c] = (x[MAP_SPECULAR + c] + 1) / 2;
    }
    s->roughness = (x[MAP_ROUGHNESS] + 1) / 2;
    if (s->roughness < guards->roughness) {
        s->roughness = guards->roughness;
        s->slope[MAP_ROUGHNESS] = 0;
    }

    double nx = x[MAP_NORMAL], ny = x[MAP_NORMAL + 1], z2 = 1 - nx * nx - ny * ny;
    bool guard = z2 < guards->nz2;
    double nz = sqrt(guard ? guards->nz2 : z2), length = sqrt(nx * nx + ny * ny + nz * nz);
    double n[3] = {nx / length, ny / length, nz / length};
    for (int j = 0; j < 2; j++) {
        /* before the division by the length: (1, 0, -nx/nz) or (0, 1, -ny/nz); in the guard n_z is constant */
        double d[3] = {j == 0, j == 1, guard ? 0 : -x[MAP_NORMAL + j] / nz}, along = dot3(d, n);
        for (int i = 0; i < 3; i++) s->dn[j][i] = (d[i] - along * n[i]) / length;
    }
    for (int i = 0; i < 3; i++) s->n[i] = n[i];
}

void rd_decode_double(const double maps[MAP_CHANNELS], rd_surface *s) { decode(&rd_guards, maps, s); }

double rd_fresnel(double vh) { return exp2((-5.55473 * vh - 6.98316) * vh); }

double rd_half(const double l[3], const double v[3], double h[3])
{
    for (int i = 0; i < 3; i++) h[i] = l[i] + v[i];
    return normalize3(h) / 2; /* |l + v|^2 = 2 + 2 l.v = 2 v.(l + v) */
}

/* f and what its derivatives are made of. */
typedef struct lobe {
    double nl, nv, h[3], fresnel, specular; /* fresnel: F = s + (1 - s) fresnel; specular: D G / 4 as in brdf.h */
    double by_alpha, by_nl, by_nv, by_nh;   /* d specular / d each */
    bool seen;
} lobe;

static lobe evaluate(const ts_shade_guards *guards, const rd_surface *s, const double l[3], const double v[3])
{
    lobe b = {.nl = dot3(s->n, l), .nv = dot3(s->n, v)};
    double vh = rd_half(l, v, b.h);
    b.seen = b.nl > 0 && b.nv > 0 && vh > 0; /* opposite l and v have no half vector; there n.l = -n.v */
    if (!b.seen) return b;
    double nh = dot3(s->n, b.h), alpha = rd_alpha(s->roughness), k = alpha / 2 + guards->k, a2 = alpha * alpha;
    double s2 = cross2(s->n, b.h), inner = a2 * nh * nh + s2, below = PI * inner * inner + guards->distribution;
    double gl = b.nl * (1 - k) + k, gv = b.nv * (1 - k) + k;
    /* Without a guard this is 1 / 4, and its logarithm has no derivative. */
    double cosines = b.nl * b.nv / (4 * b.nl * b.nv + guards->cosines),
           by_cosine = guards->cosines / (4 * b.nl * b.nv + guards->cosines);
    b.specular = a2 / below / (gl * gv) * cosines;
    b.fresnel = rd_fresnel(vh);
    b.by_alpha = b.specular *
        (2 * (PI * inner * (s2 - a2 * nh * nh) + guards->distribution) / (alpha * below) -
         ((1 - b.nl) / gl + (1 - b.nv) / gv) / 2);
    b.by_nl = b.specular * (by_cosine / b.nl - (1 - k) / gl);
    b.by_nv = b.specular * (by_cosine / b.nv - (1 - k) / gv);
    b.by_nh = b.specular * 4 * PI * inner * (1 - alpha) * (1 + alpha) * nh /
        below; /* n moves on the sphere, so |n x h|^2 = 1 - (n.h)^2 */
    return b;
}

void rd_brdf(const rd_surface *s, const double l[3], const double v[3], double f[3], double specular[3])
{
    lobe b = evaluate(&rd_guards, s, l, v);
    for (int c = 0; c < 3; c++) {
        double mirror = b.seen ? b.specular * (s->specular[c] + (1 - s->specular[c]) * b.fresnel) : 0;
        f[c] = b.seen ? (1 - s->specular[c]) * s->diffuse[c] / PI + mirror : 0;
        if (specular) specular[c] = mirror;
    }
}

void rd_centre(rd_grid grid, int column, int row, double point[2])
{
    point[0] = (grid.x0 + column + 0.5) / grid.side - 0.5;
    point[1] = 0.5 - (grid.y0 + row + 0.5) / grid.side;
}

double rd_light(const rd_view *view, const double point[2], double l[3], double v[3])
{
    for (int i = 0; i < 3; i++) {
        double at = view->kind == RD_DIRECTIONS || i == 2 ? 0 : point[i];
        l[i] = view->light[i] - at;
        v[i] = view->camera[i] - at;
    }
    double distance2 = dot3(l, l);
    normalize3(l);
    normalize3(v);
    if (view->kind == RD_POINT || view->kind == RD_PUBLISHED)
        return view->power / fmax(distance2, guards_of(view)->distance2);
    return PI / fmax(l[2], rd_guards.lz);
}

void rd_radiance(const double maps[MAP_CHANNELS], const double point[2], const rd_view *view, double radiance[3],
                 double gradient[3][MAP_CHANNELS])
{
    rd_surface s;
    double l[3], v[3], strength = rd_light(view, point, l, v);
    decode(guards_of(view), maps, &s);
    lobe b = evaluate(guards_of(view), &s, l, v);
    for (int c = 0; c < 3; c++) {
        const double spec = s.specular[c], ambient = view->ambient;
        radiance[c] = ambient * (spec + (1 - spec) * s.diffuse[c]);
        for (int i = 0; gradient && i < MAP_CHANNELS; i++) gradient[c][i] = 0;
        if (gradient) {
            gradient[c][MAP_DIFFUSE + c] = ambient * (1 - spec) * s.slope[MAP_DIFFUSE + c];
            gradient[c][MAP_SPECULAR + c] = ambient * (1 - s.diffuse[c]) * s.slope[MAP_SPECULAR + c];
        }
        if (!b.seen) continue;
        double fresnel = spec + (1 - spec) * b.fresnel;
        double f = (1 - spec) * s.diffuse[c] / PI + b.specular * fresnel;
        radiance[c] += f * b.nl * strength;
        if (!gradient) continue;
        double *g = gradient[c], e = b.nl * strength;
        g[MAP_DIFFUSE + c] += e * (1 - spec) / PI * s.slope[MAP_DIFFUSE + c];
        g[MAP_SPECULAR + c] += e * (b.specular * (1 - b.fresnel) - s.diffuse[c] / PI) * s.slope[MAP_SPECULAR + c];
        g[MAP_ROUGHNESS] = e * fresnel * b.by_alpha * 2 * s.roughness * s.slope[MAP_ROUGHNESS];
        for (int j = 0; j < 2; j++) {
            double dl = dot3(s.dn[j], l), dv = dot3(s.dn[j], v), dh = dot3(s.dn[j], b.h);
            g[MAP_NORMAL + j] = (strength * f * dl + e * fresnel * (b.by_nl * dl + b.by_nv * dv + b.by_nh * dh)) *
                s.slope[MAP_NORMAL + j];
        }
    }
}
