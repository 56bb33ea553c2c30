#include "data/metallic.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
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

static double in_unit(double x) { return x < 0 ? 0 : x < 1 ? x : 1; }

/* The best base colour for metalness k, and what is left. */
static double residual(const io_texel *t, double k, double base[3])
{
    const double rest = 1 - k, over = 1 / (rest * rest + k * k), least = DIELECTRIC * rest;
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double d = (double)t->diffuse[c], s = (double)t->specular[c] - least,
                     b = in_unit((rest * d + k * s) * over), in_diffuse = b * rest - d, in_f0 = b * k - s;
        base[c] = b;
        sum += in_diffuse * in_diffuse + in_f0 * in_f0;
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
            const double k = in_unit(best + side * step), r = residual(t, k, base) + cost * k;
            if (r < least) least = r, best = k;
        }
    residual(t, best, base);
    return best;
}

typedef struct conversion {
    const io_material *m;
    float *base, *metal;
    io_metallic_error *lost; /* sums of squares of each row */
} conversion;

static void convert_rows(const void *job, int64_t begin, int64_t end)
{
    const conversion *j = job;
    const size_t n = (size_t)j->m->size;
    for (size_t y = (size_t)begin; y < (size_t)end; y++) {
        io_metallic_error e = {0};
        for (size_t i = y * n; i < (y + 1) * n; i++) {
            const io_texel t = io_texel_get(j->m->maps + i * MAP_CHANNELS);
            double base[3];
            const double k = best_metalness(&t, base);
            j->metal[i] = (float)k;
            for (size_t c = 0; c < 3; c++) {
                j->base[3 * i + c] = (float)base[c];
                const double d = base[c] * (1 - k) - (double)t.diffuse[c],
                             s = DIELECTRIC * (1 - k) + base[c] * k - (double)t.specular[c];
                e.diffuse += d * d;
                e.specular += s * s;
            }
        }
        j->lost[y] = e;
    }
}

io_metallic_error io_to_metallic(const io_material *m, float *basecolor, float *metallic, int threads)
{
    const double values = 3.0 * m->size * m->size;
    io_metallic_error e = {0}, *lost = ts_scratch(0, (size_t)m->size * sizeof *lost);
    ts_for(threads, m->size, 1, convert_rows, &(conversion){m, basecolor, metallic, lost});
    for (int y = 0; y < m->size; y++) e.diffuse += lost[y].diffuse, e.specular += lost[y].specular;
    e.diffuse = sqrt(e.diffuse / values);
    e.specular = sqrt(e.specular / values);
    return e;
}
