#include "render/scene_model.h"
#include "render/brdf.h"
#include "render/rows.h"
#include "tensor/scratch.h"
#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

_Static_assert((int)TS_SCENE_NUMBERS == (int)RD_SCENE_NUMBERS && (int)TS_SCENE_UNKNOWNS == (int)RD_SCENE_UNKNOWNS,
               "a kernel knows the numbers of a scene and the level of the roughness");

static double irradiance(double exposure)
{
    return (double)RD_FLASH_POWER / ((double)RD_FLASH_DISTANCE * (double)RD_FLASH_DISTANCE) * exp2(exposure);
}

ts_scene rd_scene_of(const float number[RD_SCENE_NUMBERS])
{
    const double height = (double)RD_FLASH_DISTANCE * exp((double)number[RD_SCENE_DISTANCE]),
                 e = irradiance((double)number[RD_SCENE_EXPOSURE]), ambient = (double)RD_SCENE_AMBIENTS * e / PI;
    ts_scene s = {.view = {.guards = &rd_guards,
                           .kind = TS_SHADE_POSITIONS,
                           .falloff = true,
                           .light = {0, 0, height},
                           .camera = {0, 0, height},
                           .power = (float)(e * height * height),
                           .ambient = (float)(ambient * (double)number[RD_SCENE_AMBIENT])},
                  .offset = RD_SCENE_OFFSET,
                  .ambient = (float)ambient,
                  .tone = number[RD_SCENE_TONE]};
    for (int i = 0; i < 2; i++) {
        s.view.camera[i] = (double)RD_SCENE_OFFSET * (double)number[RD_SCENE_CAMERA_X + i];
        s.view.light[i] = s.view.camera[i] + (double)RD_SCENE_OFFSET * (double)number[RD_SCENE_LIGHT_X + i];
    }
    return s;
}

static double tone_of(double tone, double value)
{
    if (!(value > 0 && value < 1)) return value;
    const double y = sqrt(value), w = y * (1 + tone * (1 - y) * (y - 0.5));
    return w * w;
}

void rd_scene_value(const double maps[MAP_CHANNELS], const double point[2], const double number[RD_SCENE_NUMBERS],
                    double value[3])
{
    rd_surface s;
    const double height = (double)RD_FLASH_DISTANCE * exp(number[RD_SCENE_DISTANCE]),
                 e = irradiance(number[RD_SCENE_EXPOSURE]),
                 ambient = (double)RD_SCENE_AMBIENTS * number[RD_SCENE_AMBIENT] * e / PI;
    double l[3] = {0, 0, height}, v[3] = {0, 0, height}, f[3], r2[2], nl = 0;
    for (int i = 0; i < 2; i++) {
        v[i] = (double)RD_SCENE_OFFSET * number[RD_SCENE_CAMERA_X + i] - point[i];
        l[i] = v[i] + (double)RD_SCENE_OFFSET * number[RD_SCENE_LIGHT_X + i];
    }
    r2[0] = l[0] * l[0] + l[1] * l[1] + l[2] * l[2], r2[1] = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    rd_decode_double(maps, &s);
    for (int i = 0; i < 3; i++) {
        l[i] /= sqrt(r2[0]), v[i] /= sqrt(r2[1]);
        nl += s.n[i] * l[i];
    }
    rd_brdf(&s, l, v, f, NULL);
    for (int c = 0; c < 3; c++)
        value[c] = tone_of(number[RD_SCENE_TONE],
                           f[c] * fmax(nl, 0) * e * height * height / r2[0] +
                               ambient * (s.specular[c] + (1 - s.specular[c]) * s.diffuse[c]));
}

typedef struct photograph_job {
    rd_grid grid;
    const float *maps;
    int channels;
    ts_scene scene;
    float limit, *image;
} photograph_job;

static void photograph_rows(const void *job, int64_t begin, int64_t end)
{
    const photograph_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        ts_scene_k()->render(&j->scene, &row, j->limit, j->image + y * j->grid.w * 3);
    }
}

void rd_scene_photograph(rd_grid grid, const float *maps, int channels, const float number[RD_SCENE_NUMBERS],
                         bool clamp, float *image)
{
    ts_for(grid.threads, grid.h, 1, photograph_rows,
           &(photograph_job){grid, maps, channels, rd_scene_of(number), clamp ? 1.0f : INFINITY, image});
}

/* Solves (I + q A q) z = right for n symmetric equations by Cholesky's factor, which is left in the lower triangle of
 * a. */
enum { K = RD_SCENE_UNKNOWNS };
static void factor(double a[K][K])
{
    for (int j = 0; j < K; j++)
        for (int i = j; i < K; i++) {
            double sum = a[i][j];
            for (int k = 0; k < j; k++) sum -= a[i][k] * a[j][k];
            a[i][j] = i == j ? sqrt(fmax(sum, 1)) : sum / a[j][j]; /* 1 + what is not negative */
        }
}

/* x = L^-1 x, from value first on; the others are 0. */
static void lower(double a[K][K], int first, double x[K])
{
    for (int i = first; i < K; i++) {
        for (int k = first; k < i; k++) x[i] -= a[i][k] * x[k];
        x[i] /= a[i][i];
    }
}

static void upper(double a[K][K], double x[K])
{
    for (int i = K - 1; i >= 0; i--) {
        for (int k = i + 1; k < K; k++) x[i] -= a[k][i] * x[k];
        x[i] /= a[i][i];
    }
}

typedef struct roughen_job {
    const float *maps;
    int channels;
    float factor, *to;
} roughen_job;

static void roughen(const void *job, int64_t begin, int64_t end)
{
    const roughen_job *j = job;
    const int64_t first = begin * j->channels, last = end * j->channels;
    if (j->to != j->maps) memcpy(j->to + first, j->maps + first, (size_t)(last - first) * sizeof *j->to);
    for (int64_t i = first + MAP_ROUGHNESS; i < last; i += j->channels) {
        const float x = (j->to[i] + 1) * j->factor - 1;
        j->to[i] = x < 1 ? x : 1;
    }
}

enum { WORTH = 4096 }; /* pixels that another thread is worth */

void rd_scene_roughen(int64_t pixels, const float *maps, int channels, float level, int threads, float *to)
{
    ts_for(threads, pixels, WORTH, roughen, &(roughen_job){maps, channels, expf(level), to});
}

typedef struct sums_job {
    rd_grid grid;
    const float *maps, *deviation, *image;
    float level;
    int channels, rows;
    const rd_scene_how *how;
    ts_scene scene;
    ts_scene_sums *part;
} sums_job;

static void sums_of_rows(const void *job, int64_t begin, int64_t end)
{
    const sums_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        const int y = rd_middle((int)i, j->rows, j->grid.h);
        const int64_t at = (int64_t)y * j->grid.w;
        float *maps = ts_scratch(1, (size_t)(j->grid.w * j->channels) * sizeof *maps);
        rd_scene_roughen(j->grid.w, j->maps + at * j->channels, j->channels, j->level, 1, maps);
        ts_shade_row row = rd_shade_row(j->grid, y, j->maps, j->channels);
        row.maps = maps;
        j->part[i] = (ts_scene_sums){.right = {0}};
        ts_scene_k()->normal(&j->scene, &row, j->image + at * 3, &j->how->scale, j->deviation + at * MAP_GROUPS,
                             &j->part[i]);
    }
}

/* The sums over the rows that are read, added in their order. */
static ts_scene_sums sums_of(rd_grid grid, const float *maps, int channels, const float *deviation, const float *image,
                             const rd_scene_how *how, bool least, const float unknown[K])
{
    ts_scene scene = rd_scene_of(unknown);
    const int rows = (grid.h + how->every - 1) / how->every;
    scene.least = least;
    ts_scene_sums *part = ts_scratch(0, (size_t)rows * sizeof *part), all = {.right = {0}};
    ts_for(grid.threads, rows, 1, sums_of_rows,
           &(sums_job){grid, maps, deviation, image, unknown[RD_SCENE_ROUGHNESS], channels, rows, how, scene, part});
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < TS_SCENE_PAIRS; j++) all.matrix[j] += part[i].matrix[j];
        for (int j = 0; j < K; j++) all.right[j] += part[i].right[j];
    }
    return all;
}

static float bounded(int i, double t)
{
    if (i == RD_SCENE_AMBIENT) return (float)fmax(t, 0);
    if (i == RD_SCENE_TONE) return (float)fmin(fmax(t, (double)-RD_SCENE_TONE_MOST), (double)RD_SCENE_TONE_MOST);
    return (float)t;
}

void rd_scene_fit(rd_grid grid, const float *maps, int channels, const float *deviation, const float *image,
                  const rd_scene_prior *prior, const rd_scene_how *how, float unknown[K], float after[K])
{
    const double worth = fmin((double)how->every / fmax((double)how->correlated, 1), 1);
    for (int step = 0; step < how->steps; step++) {
        const ts_scene_sums sums = sums_of(grid, maps, channels, deviation, image, how, step >= (how->steps + 1) / 2,
                                           unknown);
        double a[K][K], z[K], to[K], longest = RD_SCENE_STRIDE;
        for (int i = 0, at = 0; i < K; i++)
            for (int j = i; j < K; j++, at++) a[i][j] = a[j][i] = worth * sums.matrix[at];
        for (int i = 0; i < K; i++) {
            z[i] = worth * sums.right[i];
            for (int j = 0; j < K; j++) z[i] += a[i][j] * ((double)unknown[j] - (double)prior->mean[j]);
            z[i] *= (double)prior->deviation[i];
        }
        for (int i = 0; i < K; i++)
            for (int j = 0; j < K; j++)
                a[i][j] = (i == j) + (double)prior->deviation[i] * a[i][j] * (double)prior->deviation[j];
        factor(a);
        lower(a, 0, z), upper(a, z);
        for (int i = 0; i < K; i++) {
            to[i] = (double)prior->mean[i] + (double)prior->deviation[i] * z[i] - (double)unknown[i];
            longest = fmax(longest, fabs(to[i]));
        }
        for (int i = 0; i < K; i++) unknown[i] = bounded(i, (double)unknown[i] + to[i] * (RD_SCENE_STRIDE / longest));
        for (int i = 0; i < K && after; i++) {
            double unit[K] = {0}, sum = 0;
            unit[i] = 1;
            lower(a, i, unit);
            for (int k = i; k < K; k++) sum += unit[k] * unit[k];
            after[i] = (float)((double)prior->deviation[i] * sqrt(sum));
        }
    }
}
