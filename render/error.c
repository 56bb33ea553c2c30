/* Errors between materials, in renderings and in maps. */
#include "render/error.h"
#include "render/render.h"
#include "render/tone.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>
#include <stdlib.h>

static float limit(float x)
{
    if (!(x > -1)) return -1;
    return x > 1 ? 1 : x;
}

typedef struct difference_job {
    int w;
    float *a, *b;
    double *rows;
} difference_job;

static void difference_of_rows(const void *job, int64_t begin, int64_t end)
{
    const difference_job *j = job;
    const size_t count = (size_t)j->w * 3;
    for (int64_t y = begin; y < end; y++) {
        float *a = j->a + (size_t)y * count, *b = j->b + (size_t)y * count;
        double sum = 0;
        ts_vmath_arrays_k()->gamma((int64_t)count, a, a);
        ts_vmath_arrays_k()->gamma((int64_t)count, b, b);
        for (size_t i = 0; i < count; i++) {
            const double d = (double)a[i] - (double)b[i];
            sum += d * d;
        }
        j->rows[y] = sum;
    }
}

/* Sum of squared differences of the images, which are gamma-encoded in place; row sums in index order make it
 * independent of the threads. */
static double gamma_difference(int h, int w, float *a, float *b, double *rows)
{
    ts_for(0, h, 1, difference_of_rows, &(difference_job){w, a, b, rows});
    double sum = 0;
    for (int y = 0; y < h; y++) sum += rows[y];
    return sum;
}

double rd_render_rmse(rd_grid grid, const float *maps_a, int channels_a, const float *maps_b, int channels_b,
                      const rd_view *views, int count)
{
    if (count < 1) return NAN;
    const size_t values = (size_t)grid.h * (size_t)grid.w * 3;
    float *image = malloc(2 * values * sizeof(float));
    double *rows = malloc((size_t)grid.h * sizeof(double)), mean = -1;
    if (image && rows) {
        double sum = 0;
        for (int v = 0; v < count; v++) {
            rd_render(grid, maps_a, channels_a, &views[v], true, image);
            rd_render(grid, maps_b, channels_b, &views[v], true, image + values);
            sum += sqrt(gamma_difference(grid.h, grid.w, image, image + values, rows) / (double)values);
        }
        mean = sum / count;
    }
    free(rows);
    free(image);
    return mean;
}

static void unit_normal(const float *maps, double n[3])
{
    n[0] = (double)limit(maps[MAP_NORMAL]);
    n[1] = (double)limit(maps[MAP_NORMAL + 1]);
    const double xy = n[0] * n[0] + n[1] * n[1];
    if (xy > 1) { /* outside the disc the nearest direction is a grazing one */
        n[0] /= sqrt(xy);
        n[1] /= sqrt(xy);
    }
    n[2] = xy < 1 ? sqrt(1 - xy) : 0;
}

static double colour_difference(const float *a, const float *b)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double d = (double)rd_gamma((limit(a[c]) + 1) / 2) - (double)rd_gamma((limit(b[c]) + 1) / 2);
        sum += d * d;
    }
    return sum;
}

/* Sums of squares and of angles in radians. */
static rd_map_error map_sums(int64_t count, const float *maps_a, int channels_a, const float *maps_b, int channels_b)
{
    rd_map_error e = {0};
    for (int64_t i = 0; i < count; i++) {
        const float *a = maps_a + i * channels_a, *b = maps_b + i * channels_b;
        double na[3], nb[3];
        unit_normal(a, na);
        unit_normal(b, nb);
        double chord = 0, sum = 0;
        for (int k = 0; k < 3; k++) {
            chord += (na[k] - nb[k]) * (na[k] - nb[k]);
            sum += (na[k] + nb[k]) * (na[k] + nb[k]);
        }
        e.normal += chord;
        e.angle += 2 * atan2(sqrt(chord), sqrt(sum)); /* Kahan: accurate for nearly equal vectors, unlike acos */
        e.diffuse += colour_difference(a + MAP_DIFFUSE, b + MAP_DIFFUSE);
        e.specular += colour_difference(a + MAP_SPECULAR, b + MAP_SPECULAR);
        const double r = ((double)limit(a[MAP_ROUGHNESS]) - (double)limit(b[MAP_ROUGHNESS])) / 2;
        e.roughness += r * r;
    }
    return e;
}

rd_map_error rd_map_rmse(int64_t count, const float *maps_a, int channels_a, const float *maps_b, int channels_b)
{
    enum { BLOCK = 4096 }; /* sums of sums: the rounding of one sum grows with its length, to 1e-12 at 4096^2 pixels */
    rd_map_error e = {0};
    for (int64_t i = 0; i < count; i += BLOCK) {
        const rd_map_error s = map_sums(count - i < BLOCK ? count - i : BLOCK, maps_a + i * channels_a, channels_a,
                                        maps_b + i * channels_b, channels_b);
        e.diffuse += s.diffuse;
        e.specular += s.specular;
        e.normal += s.normal;
        e.roughness += s.roughness;
        e.angle += s.angle;
    }
    const double n = count > 0 ? (double)count : 1;
    e.diffuse = sqrt(e.diffuse / (3 * n));
    e.specular = sqrt(e.specular / (3 * n));
    e.normal = sqrt(e.normal / (3 * n));
    e.roughness = sqrt(e.roughness / n);
    e.angle *= 180 / 3.14159265358979323846 / n;
    return e;
}
