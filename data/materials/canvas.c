#include "data/materials/canvas.h"
#include "tensor/maps.h"
#include <assert.h>
#include <math.h>

float *cv_plane(io_canvas *c)
{
    assert(c->used < CANVAS_PLANES);
    return c->planes + (size_t)c->used++ * (size_t)c->count;
}

void cv_view(io_canvas *c, float closer, float x, float y)
{
    const float beside = 0.5f - 0.5f / closer, x0 = nz_clamp(x, -beside, beside), y0 = nz_clamp(y, -beside, beside);
    c->width = closer * (float)c->size;
    c->pixel = 1 / c->width;
    for (int i = 0; i < c->count; i++) {
        c->x[i] = x0 + ((float)(i % c->size) + 0.5f) * c->pixel - 0.5f / closer;
        c->y[i] = y0 + 0.5f / closer - ((float)(i / c->size) + 0.5f) * c->pixel;
    }
}

static int pixel_at(const io_canvas *c, float from_edge)
{
    return (int)nz_clamp(from_edge * c->width, 0, (float)c->size - 1);
}

int cv_column(const io_canvas *c, float x) { return pixel_at(c, x - c->x[0] + 0.5f * c->pixel); }

int cv_row(const io_canvas *c, float y) { return pixel_at(c, c->y[0] + 0.5f * c->pixel - y); }

void cv_drop(io_canvas *c, int mark) { c->used = mark; }

uint32_t cv_seed(io_canvas *c) { return ts_rng_u32(&c->rng); }

float cv_range(io_canvas *c, float lo, float hi) { return ts_rng_range(&c->rng, lo, hi); }

float cv_log_range(io_canvas *c, float lo, float hi) { return lo * expf(ts_rng_uniform(&c->rng) * logf(hi / lo)); }

bool cv_chance(io_canvas *c, float p) { return ts_rng_uniform(&c->rng) < p; }

nz_frame cv_frame(io_canvas *c, float scale, float stretch, float turns)
{
    float *u = cv_plane(c), *v = cv_plane(c);
    nz_frame f = {c->count, u, v, scale * nz_max(1, 1 / stretch) * c->pixel};
    float cosine = cosf(turns * 6.2831853f) * scale, sine = sinf(turns * 6.2831853f) * scale, down = 1 / stretch;
    float u0 = cv_range(c, -50, 50), v0 = cv_range(c, -50, 50);
    const float *x = c->x, *y = c->y;
    for (int i = 0; i < c->count; i++) {
        f.u[i] = cosine * x[i] + sine * y[i] + u0;
        f.v[i] = (cosine * y[i] - sine * x[i]) * down + v0;
    }
    return f;
}

nz_frame cv_bend(io_canvas *c, nz_frame f, float frequency, int octaves, float amount)
{
    float *u = cv_noise(c, f, NZ_SMOOTH, frequency, octaves, 0.5f),
          *v = cv_noise(c, f, NZ_SMOOTH, frequency, octaves, 0.5f);
    float scale = amount / 1.5f; /* noise seldom exceeds 1.5 standard deviations by much */
    for (int i = 0; i < c->count; i++) {
        u[i] = f.u[i] + scale * u[i];
        v[i] = f.v[i] + scale * v[i];
    }
    return (nz_frame){f.count, u, v, f.step * (1 + amount * frequency)};
}

float *cv_noise(io_canvas *c, nz_frame f, nz_kind kind, float frequency, int octaves, float gain)
{
    float *out = cv_plane(c);
    nz_fbm(f, kind, frequency, octaves, gain, cv_seed(c), out);
    return out;
}

nz_cells cv_cells(io_canvas *c)
{
    nz_cells cells;
    cells.near = cv_plane(c);
    cells.edge = cv_plane(c);
    cells.id = cv_plane(c);
    cells.x = cv_plane(c);
    cells.y = cv_plane(c);
    return cells;
}

void cv_threshold(io_canvas *c, float *plane, float edge, float width)
{
    float scale = 0.5f / nz_max(width, 1e-5f); /* a step of no width would divide by zero */
    for (int i = 0; i < c->count; i++) {
        float t = nz_clamp((plane[i] - edge) * scale + 0.5f, 0, 1);
        plane[i] = t * t * (3 - 2 * t);
    }
}

float cv_level(float coverage)
{
    /* The normal distribution's quantile by the logistic one's, 2% off in the middle and good enough for a share of an
     * area. */
    float p = nz_clamp(coverage, 0.001f, 0.999f);
    return logf((1 - p) / p) / 1.702f;
}

void cv_fill(io_canvas *c, const io_substance *s)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < c->count; i++) {
            c->diffuse[k][i] = s->diffuse[k];
            c->specular[k][i] = s->specular[k];
        }
    for (int i = 0; i < c->count; i++) {
        c->roughness[i] = s->roughness;
        c->height[i] = 0;
    }
}

void cv_cover(io_canvas *c, const float *mask, float amount, const io_substance *s)
{
    for (int k = 0; k < 3; k++) {
        float *d = c->diffuse[k], *f = c->specular[k], to_d = s->diffuse[k], to_f = s->specular[k];
        for (int i = 0; i < c->count; i++) {
            float t = amount * mask[i];
            d[i] += t * (to_d - d[i]);
            f[i] += t * (to_f - f[i]);
        }
    }
    for (int i = 0; i < c->count; i++) c->roughness[i] += amount * mask[i] * (s->roughness - c->roughness[i]);
}

/* How much a surface with this F0 is a metal, for what concerns only one of the two. */
static inline float metal(float f0) { return nz_smooth(0.08f, 0.25f, f0); }

void cv_tint(io_canvas *c, const float *mask, float amount, const io_rgb colour)
{
    for (int k = 0; k < 3; k++) {
        float *d = c->diffuse[k], to = colour[k];
        const float *f = c->specular[1];
        for (int i = 0; i < c->count; i++) d[i] += amount * mask[i] * (1 - metal(f[i])) * (to - d[i]);
    }
}

/* Values that are worked on together: short plain loops over arrays of their own are what a compiler turns into
 * vectors. */
enum { BLOCK = 256 };

void cv_shade(io_canvas *c, const float *plane, float amount)
{
    float pigment[BLOCK], metallic[BLOCK];
    for (int begin = 0; begin < c->count; begin += BLOCK) {
        const int n = c->count - begin < BLOCK ? c->count - begin : BLOCK;
        const float *in = plane + begin, *f0 = c->specular[1] + begin;
        for (int i = 0; i < n; i++) pigment[i] = nz_clamp(1 + amount * in[i], 0.1f, 2.5f);
        for (int i = 0; i < n; i++) metallic[i] = metal(f0[i]);
        /* a metal's colour varies half as much as a pigment's */
        for (int i = 0; i < n; i++) metallic[i] = 1 + metallic[i] * (0.5f * pigment[i] - 0.5f);
        for (int k = 0; k < 3; k++) {
            float *d = c->diffuse[k] + begin, *f = c->specular[k] + begin;
            for (int i = 0; i < n; i++) d[i] *= pigment[i];
            for (int i = 0; i < n; i++) f[i] *= metallic[i];
        }
    }
}

void cv_roughen(io_canvas *c, const float *plane, float amount)
{
    for (int i = 0; i < c->count; i++) c->roughness[i] += amount * plane[i];
}

void cv_raise(io_canvas *c, const float *plane, float amount)
{
    for (int i = 0; i < c->count; i++) c->height[i] += amount * plane[i];
}

float *cv_cavity(io_canvas *c, float radius)
{
    float *out = cv_plane(c), *work = cv_plane(c);
    int pixels = (int)(radius * c->width + 0.5f);
    nz_blur(c->size, pixels < 1 ? 1 : pixels, c->height, out, work);
    cv_drop(c, c->used - 1);
    float scale = 6 / radius; /* a groove as deep as a sixth of its width counts as fully deep */
    for (int i = 0; i < c->count; i++) {
        float d = (out[i] - c->height[i]) * scale;
        out[i] = d / (1 + nz_abs(d));
    }
    return out;
}

/* The slopes of n pixels from column x0 of row y, to the right and up, at most 2.5: a patch seen from the front hides
 * steeper flanks. */
static void slopes(const io_canvas *c, int y, int x0, int n, float *p, float *q)
{
    const int size = c->size, up = y > 0 ? y - 1 : y, down = y + 1 < size ? y + 1 : y;
    const float *row = c->height + (size_t)y * (size_t)size, *above = c->height + (size_t)up * (size_t)size;
    const float *below = c->height + (size_t)down * (size_t)size;
    const float per_y = down > up ? c->width / (float)(down - up) : 0, per_x = c->width / 2;
    const int first = x0 > 0 ? 0 : 1, last = x0 + n < size ? n : n - 1;
    for (int i = first; i < last; i++) p[i] = (row[x0 + i + 1] - row[x0 + i - 1]) * per_x;
    if (first && size > 1) p[0] = (row[1] - row[0]) * c->width;
    if (last < n && size > 1) p[n - 1] = (row[size - 1] - row[size - 2]) * c->width;
    if (size == 1) p[0] = 0;
    for (int i = 0; i < n; i++) q[i] = (above[x0 + i] - below[x0 + i]) * per_y;
    for (int i = 0; i < n; i++) {
        const float limit = 1 / sqrtf(1 + 0.16f * (p[i] * p[i] + q[i] * q[i]));
        p[i] *= limit;
        q[i] *= limit;
    }
}

void cv_write(const io_canvas *c, float *maps)
{
    const int size = c->size;
    float p[BLOCK], q[BLOCK], z[BLOCK], plane[MAP_CHANNELS][BLOCK];
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x += BLOCK) {
            const int n = size - x < BLOCK ? size - x : BLOCK;
            const size_t at = (size_t)y * (size_t)size + (size_t)x;
            slopes(c, y, x, n, p, q);
            for (int i = 0; i < n; i++) z[i] = 1 / sqrtf(1 + p[i] * p[i] + q[i] * q[i]);
            for (int i = 0; i < n; i++) plane[MAP_NORMAL][i] = -p[i] * z[i];
            for (int i = 0; i < n; i++) plane[MAP_NORMAL + 1][i] = -q[i] * z[i];
            for (int k = 0; k < 3; k++) {
                const float *d = c->diffuse[k] + at, *f = c->specular[k] + at;
                for (int i = 0; i < n; i++)
                    plane[MAP_DIFFUSE + k][i] = 2 * nz_clamp(d[i], 0, 0.95f) - 1; /* nothing in nature is whiter */
                for (int i = 0; i < n; i++) plane[MAP_SPECULAR + k][i] = 2 * nz_clamp(f[i], 0.01f, 1) - 1;
            }
            for (int i = 0; i < n; i++)
                plane[MAP_ROUGHNESS][i] = 2 * nz_clamp(c->roughness[at + (size_t)i], 0.03f, 1) - 1;
            for (int i = 0; i < n; i++)
                for (int k = 0; k < MAP_CHANNELS; k++) maps[(at + (size_t)i) * MAP_CHANNELS + (size_t)k] = plane[k][i];
        }
}
