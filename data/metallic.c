#include "data/metallic.h"
#include <math.h>

#define DIELECTRIC 0.04 /* F0 of everything that is no metal, in this workflow */
/* What is dark all over is a dielectric or a metal that is as dark as its F0: metalness costs as much as an error of a
 * tenth in one value where F0 and diffuse are at most DARK, and nothing where one of them is BRIGHT. */
#define COST 0.01
#define DARK 0.08
#define BRIGHT 0.16

/* 1 to 0 for the largest of the three values. */
static double is_dark(const float v[3])
{
    const double most = (double)fmaxf(fmaxf(v[0], v[1]), v[2]), x = fmin(fmax((most - DARK) / (BRIGHT - DARK), 0), 1);
    return 1 - x * x * (3 - 2 * x);
}

/* The best base colour for metalness k, and what is left. */
static double residual(const io_texel *t, double k, double base[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double d = (double)t->diffuse[c], s = (double)t->specular[c] - DIELECTRIC * (1 - k);
        const double b = fmin(fmax(((1 - k) * d + k * s) / ((1 - k) * (1 - k) + k * k), 0), 1);
        base[c] = b;
        sum += (b * (1 - k) - d) * (b * (1 - k) - d) + (b * k - s) * (b * k - s);
    }
    return sum;
}

/* The least residual: the best of a grid, then halved around it. The residual is smooth but may have two valleys. */
static double best_metalness(const io_texel *t, double base[3])
{
    enum { GRID = 16, HALVINGS = 12 };
    const double cost = COST * is_dark(t->specular) * is_dark(t->diffuse);
    double best = 0, least = INFINITY;
    for (int i = 0; i <= GRID; i++) {
        const double k = (double)i / GRID, r = residual(t, k, base) + cost * k;
        if (r < least) least = r, best = k;
    }
    double step = 0.5 / GRID;
    for (int i = 0; i < HALVINGS; i++, step /= 2)
        for (int side = -1; side <= 1; side += 2) {
            const double k = fmin(fmax(best + side * step, 0), 1), r = residual(t, k, base) + cost * k;
            if (r < least) least = r, best = k;
        }
    residual(t, best, base);
    return best;
}

io_metallic_error io_to_metallic(const io_material *m, float *basecolor, float *metallic)
{
    const size_t pixels = (size_t)m->size * (size_t)m->size;
    io_metallic_error e = {0};
    for (size_t i = 0; i < pixels; i++) {
        const io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
        double base[3];
        const double k = best_metalness(&t, base);
        metallic[i] = (float)k;
        for (int c = 0; c < 3; c++) {
            basecolor[3 * i + (size_t)c] = (float)base[c];
            const double d = base[c] * (1 - k) - (double)t.diffuse[c],
                         s = DIELECTRIC * (1 - k) + base[c] * k - (double)t.specular[c];
            e.diffuse += d * d;
            e.specular += s * s;
        }
    }
    e.diffuse = sqrt(e.diffuse / (3.0 * (double)pixels));
    e.specular = sqrt(e.specular / (3.0 * (double)pixels));
    return e;
}
