#include "data/metallic.h"
#include <math.h>

#define DIELECTRIC 0.04 /* F0 of everything that is no metal, in this workflow */

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
    double best = 0, least = INFINITY;
    for (int i = 0; i <= GRID; i++) {
        const double r = residual(t, (double)i / GRID, base);
        if (r < least) least = r, best = (double)i / GRID;
    }
    double step = 0.5 / GRID;
    for (int i = 0; i < HALVINGS; i++, step /= 2)
        for (int side = -1; side <= 1; side += 2) {
            const double k = fmin(fmax(best + side * step, 0), 1), r = residual(t, k, base);
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
