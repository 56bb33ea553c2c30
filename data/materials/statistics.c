#include "data/materials/statistics.h"
#include "data/name.h"
#include "tensor/rng.h"
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { DIFFUSE, ROUGHNESS, SPECULAR, SLOPE, PLANES, SATURATION = PLANES };

static const char *const names[IO_FEATURES] = {
    "mean diffuse",       "mean roughness",  "mean specular",     "mean slope",       "spread diffuse",
    "spread roughness",   "spread specular", "spread slope",      "gradient diffuse", "gradient roughness",
    "gradient specular",  "gradient slope",  "diffuse~roughness", "diffuse~specular", "diffuse~slope",
    "roughness~specular", "roughness~slope", "specular~slope",    "saturation",       "metal"};

const char *io_feature_name(int feature) { return feature >= 0 && feature < IO_FEATURES ? names[feature] : "none"; }

void io_values(const float *m, double out[IO_VALUES])
{
    io_texel t = io_texel_get(m);
    const float *d = t.diffuse, *s = t.specular;
    out[DIFFUSE] = pow(fmax(0, 0.2126 * d[0] + 0.7152 * d[1] + 0.0722 * d[2]), 1 / 2.2);
    out[SPECULAR] = pow(fmax(0, 0.2126 * s[0] + 0.7152 * s[1] + 0.0722 * s[2]), 1 / 2.2);
    out[ROUGHNESS] = t.roughness;
    out[SLOPE] = sqrt((double)t.normal[0] * t.normal[0] + (double)t.normal[1] * t.normal[1]);
    double hi = fmax(m[MAP_DIFFUSE], fmax(m[MAP_DIFFUSE + 1], m[MAP_DIFFUSE + 2])) + 1,
           lo = fmin(m[MAP_DIFFUSE], fmin(m[MAP_DIFFUSE + 1], m[MAP_DIFFUSE + 2])) + 1;
    out[SATURATION] = (hi - lo) / (hi + 0.02); /* black has no hue, only noise: 0.01 of albedo keeps it out */
}

ts_code io_features(const float *maps, int size, double out[IO_FEATURES], ts_status *st)
{
    double sum[PLANES] = {0}, product[PLANES][PLANES] = {{0}}, gradient[PLANES] = {0}, colour = 0, metal = 0,
           *above = calloc((size_t)size, PLANES * sizeof *above);
    const double count = (double)size * size, inner = size > 1 ? (double)(size - 1) * (size - 1) : 1;
    memset(out, 0, IO_FEATURES * sizeof *out);
    if (!above) return ts_fail(st, TS_NOMEM, "statistics: no memory for a row of %d pixels", size);
    for (int y = 0; y < size; y++) {
        double left[PLANES] = {0};
        for (int x = 0; x < size; x++) {
            const float *m = maps + ((size_t)y * (size_t)size + (size_t)x) * MAP_CHANNELS;
            double v[IO_VALUES], *up = above + (size_t)x * PLANES;
            io_values(m, v);
            for (int k = 0; k < PLANES; k++) {
                if (x && y) gradient[k] += sqrt((v[k] - left[k]) * (v[k] - left[k]) + (v[k] - up[k]) * (v[k] - up[k]));
                sum[k] += v[k];
                for (int j = 0; j <= k; j++) product[j][k] += v[j] * v[k];
                left[k] = up[k] = v[k];
            }
            colour += v[SATURATION];
            metal += v[SPECULAR] > 0.4223; /* 0.15^(1/2.2) */
        }
    }
    free(above);
    int at = 3 * PLANES;
    double deviation[PLANES];
    for (int k = 0; k < PLANES; k++) {
        out[k] = sum[k] / count;
        out[PLANES + k] = deviation[k] = sqrt(fmax(0, product[k][k] / count - out[k] * out[k]));
        out[2 * PLANES + k] = gradient[k] / inner * size / 64;
    }
    for (int j = 0; j < PLANES; j++)
        for (int k = j + 1; k < PLANES; k++, at++) {
            bool varies = deviation[j] > 1e-3 &&
                deviation[k] > 1e-3; /* below that an 8-bit file holds rounding alone */
            out[at] = varies ? (product[j][k] / count - out[j] * out[k]) / (deviation[j] * deviation[k]) : 0;
        }
    out[at] = colour / count;
    out[at + 1] = metal / count;
    return TS_OK;
}

void io_feature_set_free(io_feature_set *set)
{
    free(set->values);
    *set = (io_feature_set){0};
}

ts_code io_features_procedural(const io_procedural *p, uint64_t first, int count, int size, io_feature_set *set,
                               ts_status *st)
{
    *set = (io_feature_set){.values = calloc((size_t)count, sizeof *set->values)};
    io_material m = {0};
    if (!set->values) return ts_fail(st, TS_NOMEM, "statistics: no memory for %d materials", count);
    if (io_material_create(&m, size, st)) {
        io_feature_set_free(set);
        return st ? st->code : TS_NOMEM;
    }
    ts_code code = TS_OK;
    for (; set->count < count && !code; set->count++) {
        io_procedural_make(p, first + (uint64_t)set->count, &m);
        code = io_features(m.maps, size, set->values[set->count], st);
    }
    io_material_free(&m);
    if (code) io_feature_set_free(set);
    return code;
}

static int not_hidden(const struct dirent *e) { return e->d_name[0] != '.'; }

/* What lies beside the materials is none. */
static bool is_material(const char *path, const char *name, bool strips)
{
    struct stat about;
    if (stat(path, &about)) return true; /* a link that leads nowhere: reading it says so */
    return strips ? S_ISREG(about.st_mode) && io_is_image_name(name) : S_ISDIR(about.st_mode);
}

/* Calls visit for all materials of one folder; an absent folder is empty. */
static ts_code visit_folder(const char *folder, bool strips, int size, io_visit *visit, void *context, ts_status *st)
{
    struct dirent **list = NULL;
    int n = scandir(folder, &list, not_hidden, alphasort);
    ts_code code = TS_OK;
    if (n < 0) return errno == ENOENT ? TS_OK : ts_fail(st, TS_IO, "%s: %s", folder, strerror(errno));
    for (int i = 0; i < n; i++) {
        char path[4096];
        io_material m = {0};
        if (!code && snprintf(path, sizeof path, "%s/%s", folder, list[i]->d_name) >= (int)sizeof path)
            code = ts_fail(st, TS_INVALID, "%s: the path is too long", folder);
        const bool wanted = !code && is_material(path, list[i]->d_name, strips);
        if (wanted)
            code = strips ? io_read_strip(path, size, &m, NULL, st) : io_read_map_folder(path, NULL, size, &m, st);
        if (wanted && !code) code = visit(context, &m, st);
        io_material_free(&m);
        free(list[i]);
    }
    free(list);
    return code;
}

ts_code io_visit_materials(const char *folder, int size, io_visit *visit, void *context, ts_status *st)
{
    char maps[4096], strips[4096];
    if (snprintf(maps, sizeof maps, "%s/maps", folder) >= (int)sizeof maps ||
        snprintf(strips, sizeof strips, "%s/strips", folder) >= (int)sizeof strips)
        return ts_fail(st, TS_INVALID, "%s: the path is too long", folder);
    ts_code code = visit_folder(maps, false, size, visit, context, st);
    return code ? code : visit_folder(strips, true, size, visit, context, st);
}

static ts_code add_features(void *context, const io_material *m, ts_status *st)
{
    io_feature_set *set = context;
    double(*grown)[IO_FEATURES] = realloc(set->values, (size_t)(set->count + 1) * sizeof *grown);
    if (!grown) return ts_fail(st, TS_NOMEM, "statistics: no memory for %d materials", set->count + 1);
    set->values = grown;
    return io_features(m->maps, m->size, set->values[set->count++], st);
}

ts_code io_features_folder(const char *folder, int size, io_feature_set *set, ts_status *st)
{
    *set = (io_feature_set){0};
    ts_code code = io_visit_materials(folder, size, add_features, set, st);
    if (!code && set->count < 2)
        code = ts_fail(st, TS_IO, "%s: needs at least two materials in maps/ and strips/, has %d", folder, set->count);
    if (code) io_feature_set_free(set);
    return code;
}

void io_feature_summary(const io_feature_set *set, int feature, double *mean, double *deviation)
{
    double sum = 0, squares = 0;
    for (int i = 0; i < set->count; i++) sum += set->values[i][feature];
    *mean = sum / set->count;
    for (int i = 0; i < set->count; i++)
        squares += (set->values[i][feature] - *mean) * (set->values[i][feature] - *mean);
    *deviation = sqrt(squares / set->count);
}

double io_feature_distance(const io_feature_set *a, const io_feature_set *b, double each[IO_FEATURES])
{
    double total = 0;
    for (int f = 0; f < IO_FEATURES; f++) {
        double ma, mb, sa, sb;
        io_feature_summary(a, f, &ma, &sa);
        io_feature_summary(b, f, &mb, &sb);
        double pooled = sqrt(0.5 * (sa * sa + sb * sb)),
               d = pooled > 0 ? (fabs(ma - mb) + fabs(sa - sb)) / pooled : ma != mb; /* constant in both */
        if (each) each[f] = d;
        total += d;
    }
    return total / IO_FEATURES;
}

double io_feature_halves(const io_feature_set *set, int rounds, uint64_t seed)
{
    int half = set->count / 2;
    double total = 0;
    io_feature_set all = {set->count, malloc((size_t)set->count * sizeof *all.values)};
    if (!all.values) return 0;
    memcpy(all.values, set->values, (size_t)set->count * sizeof *all.values);
    for (int r = 0; r < rounds; r++) {
        ts_rng rng = ts_rng_make(seed, TS_STREAM_EVAL, (uint64_t)r);
        for (int i = 0; i < half; i++) { /* Fisher-Yates as far as it is needed */
            int j = i + ts_rng_int(&rng, set->count - i);
            double swap[IO_FEATURES];
            memcpy(swap, all.values[i], sizeof swap);
            memcpy(all.values[i], all.values[j], sizeof swap);
            memcpy(all.values[j], swap, sizeof swap);
        }
        io_feature_set a = {half, all.values}, b = {set->count - half, all.values + half};
        total += io_feature_distance(&a, &b, NULL);
    }
    free(all.values);
    return total / rounds;
}
