#include "data/materials/joint.h"
#include "data/height.h"
#include "tensor/conv/gemm.h"
#include "tensor/memory.h"
#include <math.h>
#include <stdlib.h>

enum {
    BANDS = 3,
    RELIEF = 0,
    SLOPE = 1,
    DIFFUSE = SLOPE + BANDS,
    ROUGHNESS = DIFFUSE + BANDS,
    F0 = ROUGHNESS + BANDS,
    GLOSS
};

static const char *const names[IO_JOINTS] = {"relief",
                                             "relief 2-8",
                                             "relief 8-32",
                                             "relief 32-64",
                                             "height~diffuse 2-8",
                                             "height~diffuse 8-32",
                                             "height~diffuse 32-64",
                                             "height~roughness 2-8",
                                             "height~roughness 8-32",
                                             "height~roughness 32-64",
                                             "F0",
                                             "roughness"};
static const double limit[BANDS + 1] = {2, 8, 32, 64}; /* cycles a patch */

const char *io_joint_name(int joint) { return joint >= 0 && joint < IO_JOINTS ? names[joint] : "none"; }

/* The cosine transform of plane, in place; work is as large. */
static void transform(int n, const float *cosines, float *plane, float *work)
{
    ts_gemm(false, false, n, n, n, 1, cosines, plane, 0, work, 1);
    ts_gemm(false, true, n, n, n, 1, work, cosines, 0, plane, 1);
}

/* sum[k][b]: over the coefficients of band b the products of planes pair[k]. */
static void products(int n, float *const *plane, int pairs, const int (*pair)[2], double (*sum)[BANDS])
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double square = 0.25 * ((double)i * i + (double)j * j);
            const size_t at = (size_t)i * (size_t)n + (size_t)j;
            int band = 0;
            while (band < BANDS && square >= limit[band + 1] * limit[band + 1]) band++;
            if (band == BANDS || square < limit[0] * limit[0]) continue;
            for (int k = 0; k < pairs; k++) sum[k][band] += (double)plane[pair[k][0]][at] * plane[pair[k][1]][at];
        }
}

ts_code io_joint(const io_material *m, double out[IO_JOINTS], ts_status *st)
{
    enum { X, Y, HEIGHT, COLOUR, GLOSSES, PLANES };
    const int n = m->size;
    const size_t pixels = (size_t)n * (size_t)n;
    float *memory = ts_memory((PLANES + 2) * pixels * sizeof *memory);
    if (!memory) return ts_fail(st, TS_NOMEM, "no memory for statistics of %d x %d pixels", n, n);
    float *plane[PLANES], *cosines = memory + PLANES * pixels, *work = cosines + pixels;
    for (int k = 0; k < PLANES; k++) plane[k] = memory + (size_t)k * pixels;
    double f0 = 0, gloss = 0, relief = 0;
    for (size_t i = 0; i < pixels; i++) {
        const io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
        double v[IO_VALUES];
        io_values(m->maps + i * MAP_CHANNELS, v);
        plane[X][i] = t.normal[0], plane[Y][i] = t.normal[1];
        plane[COLOUR][i] = (float)v[0], plane[GLOSSES][i] = t.roughness;
        relief += (double)t.normal[0] * t.normal[0] + (double)t.normal[1] * t.normal[1];
        f0 += 0.2126 * t.specular[0] + 0.7152 * t.specular[1] + 0.0722 * t.specular[2];
        gloss += t.roughness;
    }
    const ts_code code = io_height(m, false, plane[HEIGHT], 1, st);
    if (!code) {
        io_cosines(n, cosines);
        for (int k = 0; k < PLANES; k++) transform(n, cosines, plane[k], work);
        static const int pair[][2] = {
            {X, X},           {Y, Y},           {HEIGHT, HEIGHT}, {COLOUR, COLOUR}, {GLOSSES, GLOSSES},
            {HEIGHT, COLOUR}, {HEIGHT, GLOSSES}};
        double sum[7][BANDS] = {{0}};
        const double *x = sum[0], *y = sum[1], *h = sum[2], *d = sum[3], *r = sum[4], *hd = sum[5], *hr = sum[6];
        products(n, plane, 7, pair, sum);
        const double count = (double)pixels, least = 1e-6 * count; /* below that an 8-bit file holds rounding alone */
        for (int k = 0; k < BANDS; k++) {
            const bool steep = x[k] + y[k] > least;
            out[SLOPE + k] = sqrt((x[k] + y[k]) / count);
            out[DIFFUSE + k] = steep && d[k] > least ? hd[k] / sqrt(h[k] * d[k]) : 0;
            out[ROUGHNESS + k] = steep && r[k] > least ? hr[k] / sqrt(h[k] * r[k]) : 0;
        }
        out[RELIEF] = sqrt(relief / count);
        out[F0] = f0 / count;
        out[GLOSS] = gloss / count;
    }
    free(memory);
    return code;
}

void io_joint_set_free(io_joint_set *set)
{
    free(set->values);
    *set = (io_joint_set){0};
}

ts_code io_joint_add(io_joint_set *set, const io_material *m, ts_status *st)
{
    double(*grown)[IO_JOINTS] = realloc(set->values, (size_t)(set->count + 1) * sizeof *grown);
    if (!grown) return ts_fail(st, TS_NOMEM, "statistics: no memory for %d materials", set->count + 1);
    set->values = grown;
    const ts_code code = io_joint(m, set->values[set->count], st);
    set->count += !code;
    return code;
}

static ts_code visit(void *context, const io_material *m, ts_status *st) { return io_joint_add(context, m, st); }

ts_code io_joint_folder(const char *folder, int size, io_joint_set *set, ts_status *st)
{
    return io_visit_materials(folder, size, visit, set, st);
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double io_joint_quantile(const io_joint_set *set, int joint, double share)
{
    double *sorted = malloc((size_t)set->count * sizeof *sorted);
    if (!sorted) return 0;
    for (int i = 0; i < set->count; i++) sorted[i] = set->values[i][joint];
    qsort(sorted, (size_t)set->count, sizeof *sorted, by_value);
    const double at = share * (set->count - 1);
    const int low = (int)at, high = low + 1 < set->count ? low + 1 : low;
    const double value = sorted[low] + (at - low) * (sorted[high] - sorted[low]);
    free(sorted);
    return value;
}
