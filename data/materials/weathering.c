#include "data/materials/weathering.h"
#include "data/materials/palette.h"
#include <math.h>

static const uint32_t dirt_colours[] = {0x3a3026, 0x2b2620, 0x4d4030, 0x1c1a18, 0x5a4632, 0x6b5c46, 0x353a2a, 0x201d1b};

void wear_dirt(io_canvas *c, float radius, float amount)
{
    int mark = c->used;
    io_rgb colour;
    pal_pick(c, dirt_colours, PAL_COUNT(dirt_colours), 0.6f, colour);
    io_substance dirt = pal_dielectric(c, colour, cv_range(c, 0.7f, 1));
    float *cavity = cv_cavity(c, radius);
    nz_frame f = cv_frame(c, 1, 1, 0);
    float *patch = cv_noise(c, f, NZ_SMOOTH, cv_range(c, 1.5f, 4), 4, 0.55f);
    float deep = cv_range(c, 0.4f, 1.5f), wide = cv_range(c, 0.1f, 0.5f);
    for (int i = 0; i < c->count; i++) cavity[i] = deep * cavity[i] + wide * patch[i];
    cv_threshold(c, cavity, 0.6f - 0.5f * amount, 0.6f);
    cv_cover(c, cavity, nz_min(1, 0.35f + 0.6f * amount), &dirt);
    cv_drop(c, mark);
}

void wear_edges(io_canvas *c, float radius, float amount, const io_substance *s)
{
    int mark = c->used;
    float *rise = cv_cavity(c, radius);
    nz_frame f = cv_frame(c, 1, 1, 0);
    float *broken = cv_noise(c, f, NZ_SMOOTH, cv_range(c, 4, 12), 4, 0.65f);
    for (int i = 0; i < c->count; i++) rise[i] = -rise[i] + 0.16f * broken[i];
    cv_threshold(c, rise, 0.62f - 0.45f * amount, s ? 0.06f : 0.3f);
    if (s) cv_cover(c, rise, 1, s);
    else {
        cv_shade(c, rise, cv_range(c, 0.15f, 0.6f));
        cv_roughen(c, rise, cv_range(c, -0.2f, 0.1f));
    }
    cv_drop(c, mark);
}

/* Adds the coverage of a slightly bent line from a to b (patch widths) with the given half width to mask. */
static void line(const io_canvas *c, float ax, float ay, float bx, float by, float half, float strength, float *mask)
{
    float width = nz_max(half, 0.7f * c->pixel),
          weight = strength * half / width; /* thinner than a pixel: fainter instead */
    float lx = bx - ax, ly = by - ay, inverse = 1 / (lx * lx + ly * ly + 1e-8f);
    int x0 = cv_column(c, nz_min(ax, bx) - width), x1 = cv_column(c, nz_max(ax, bx) + width);
    int y0 = cv_row(c, nz_max(ay, by) + width), y1 = cv_row(c, nz_min(ay, by) - width);
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            int i = y * c->size + x;
            float px = c->x[i] - ax, py = c->y[i] - ay, t = nz_clamp((px * lx + py * ly) * inverse, 0, 1);
            float dx = px - t * lx, dy = py - t * ly, d2 = (dx * dx + dy * dy) / (width * width);
            float cover = nz_max(0, 1 - d2) * weight * (1 - t * t * t * t);
            mask[i] = nz_min(1, mask[i] + cover);
        }
}

void wear_scratches(io_canvas *c, int count, float longest, const io_substance *bare)
{
    int mark = c->used;
    float *mask = cv_plane(c);
    for (int i = 0; i < c->count; i++) mask[i] = 0;
    float main_turn = cv_range(c, 0, 1), scatter = cv_chance(c, 0.5f) ? 0.5f : cv_range(c, 0.01f, 0.1f);
    for (int k = 0; k < count; k++) {
        float turn = (main_turn + cv_range(c, -scatter, scatter)) * 6.2831853f,
              length = longest * cv_log_range(c, 0.1f, 1);
        float x = cv_range(c, -0.6f, 0.6f), y = cv_range(c, -0.6f, 0.6f), half = cv_log_range(c, 0.0007f, 0.004f),
              strength = cv_range(c, 0.3f, 1);
        for (int part = 0; part < 2; part++) { /* two pieces make a bend */
            float nx = x + 0.5f * length * cosf(turn), ny = y + 0.5f * length * sinf(turn);
            line(c, x, y, nx, ny, half, strength, mask);
            x = nx;
            y = ny;
            turn += cv_range(c, -0.25f, 0.25f);
        }
    }
    if (bare) cv_cover(c, mask, 1, bare);
    else {
        cv_shade(c, mask, cv_range(c, -0.3f, 0.5f));
        cv_roughen(c, mask, cv_range(c, -0.1f, 0.25f));
    }
    cv_raise(c, mask, -cv_log_range(c, 0.0002f, 0.0015f));
    cv_drop(c, mark);
}

void wear_stains(io_canvas *c, float amount)
{
    int mark = c->used;
    nz_frame f = cv_frame(c, 1, cv_range(c, 0.8f, 1.6f), 0), bent = cv_bend(c, f, 2, 2, 0.02f);
    float gain = cv_range(c, 0.45f, 0.65f), frequency = cv_log_range(c, 0.8f, 4),
          *patch = cv_noise(c, bent, NZ_SMOOTH, frequency, 5, gain);
    float blur = cv_range(c, 0.2f, 1.5f), edge = cv_range(c, -0.3f, 1);
    cv_threshold(c, patch, edge, blur);
    cv_shade(c, patch, amount * cv_range(c, -0.8f, 0.35f));
    cv_roughen(c, patch, amount * cv_range(c, -0.35f, 0.3f));
    cv_drop(c, mark);
}

void wear_grain(io_canvas *c, float frequency, float colour, float roughness)
{
    int mark = c->used;
    nz_frame f = cv_frame(c, 1, 1, cv_range(c, 0, 1));
    float *grain = cv_noise(c, f, NZ_SMOOTH, frequency, 5, 0.8f);
    cv_shade(c, grain, colour);
    cv_roughen(c, grain, roughness);
    cv_drop(c, mark);
}

void wear_texture(io_canvas *c, float frequency, float slope)
{
    int mark = c->used;
    float stretch = cv_chance(c, 0.25f) ? cv_log_range(c, 1, 6) : 1, turns = cv_range(c, 0, 1);
    nz_frame f = cv_frame(c, 1, stretch, turns);
    nz_kind kind = cv_chance(c, 0.7f) ? NZ_SMOOTH : cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_BILLOW;
    float *fine = cv_noise(c, f, kind, frequency, 4, 0.6f);
    cv_raise(c, fine, slope / (6.2831853f * frequency));
    cv_roughen(c, fine, cv_range(c, -0.03f, 0.06f));
    cv_drop(c, mark);
}

void wear_streaks(io_canvas *c, float amount)
{
    static const uint32_t run[] = {0x6b3a1e, 0x8a4a22, 0x3a2c22, 0xd8d4c8, 0x2a2826, 0x4a5240};
    int mark = c->used;
    io_rgb colour;
    pal_pick(c, run, PAL_COUNT(run), 0.5f, colour);
    io_substance dry = pal_dielectric(c, colour, cv_range(c, 0.5f, 0.95f));
    float long_by = cv_range(c, 6, 20), often = cv_log_range(c, 4, 20);
    nz_frame f = cv_bend(c, cv_frame(c, often, long_by, cv_chance(c, 0.85f) ? 0 : 0.25f), 0.6f, 2, 0.1f);
    float *streak = cv_noise(c, f, NZ_SMOOTH, 1, 5, 0.6f), edge = cv_range(c, 0.3f, 1.2f), blur = cv_range(c, 0.2f, 1);
    nz_frame wide = cv_frame(c, 1, 1, 0);
    float *where = cv_noise(c, wide, NZ_SMOOTH, 1.5f, 3, 0.5f);
    for (int i = 0; i < c->count; i++) streak[i] += 0.5f * where[i];
    cv_threshold(c, streak, edge, blur);
    cv_cover(c, streak, amount, &dry);
    cv_drop(c, mark);
}

void wear_wet(io_canvas *c, float coverage)
{
    int mark = c->used;
    nz_frame f = cv_frame(c, 1, 1, 0);
    float *level = cv_noise(c, f, NZ_SMOOTH, cv_range(c, 0.7f, 2.5f), 3, 0.5f), *cavity = cv_cavity(c, 0.05f);
    float roughness = cv_log_range(c, 0.04f, 0.2f), edge = cv_level(coverage);
    for (int i = 0; i < c->count; i++) {
        float wet = nz_smooth(edge - 0.25f, edge + 0.25f, level[i] + 1.2f * cavity[i]);
        float keep = 1 - 0.5f * wet * (c->specular[1][i] < 0.1f); /* what lies under water looks darker */
        for (int k = 0; k < 3; k++) {
            c->diffuse[k][i] *= keep;
            if (c->specular[k][i] < 0.1f) c->specular[k][i] += wet * (0.022f - c->specular[k][i]); /* F0 of water */
        }
        c->roughness[i] += wet * (roughness - c->roughness[i]);
        c->height[i] *= 1 - 0.75f * wet; /* its surface is flat */
    }
    cv_drop(c, mark);
}

void wear_smudges(io_canvas *c, float amount)
{
    int mark = c->used;
    float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 4), scale = cv_range(c, 2, 5);
    nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.7f, 2, 0.08f);
    float *smear = cv_noise(c, f, NZ_SMOOTH, 1, 4, 0.6f);
    cv_roughen(c, smear, amount * cv_range(c, 0.3f, 1));
    cv_drop(c, mark);
}

void wear_any(io_canvas *c, float harsh)
{
    cv_drop(c, 0);
    if (cv_chance(c, 0.3f + 0.3f * harsh)) wear_stains(c, cv_range(c, 0.3f, 1));
    if (cv_chance(c, 0.15f + 0.35f * harsh)) {
        float amount = cv_range(c, 0, 0.35f + 0.5f * harsh), radius = cv_log_range(c, 0.01f, 0.05f);
        wear_dirt(c, radius, amount);
    }
    if (cv_chance(c, 0.16f * harsh)) wear_streaks(c, cv_range(c, 0.15f, 0.8f));
    if (cv_chance(c, 0.05f)) wear_decals(c);
    if (cv_chance(c, 0.35f)) wear_smudges(c, 0.08f);
    if (cv_chance(c, 0.25f)) {
        float longest = cv_log_range(c, 0.1f, 0.8f);
        wear_scratches(c, 2 + ts_rng_int(&c->rng, 25), longest, NULL);
    }
    if (cv_chance(c, 0.5f)) {
        float roughness = cv_range(c, 0, 0.05f), colour = cv_range(c, 0, 0.1f), frequency = cv_log_range(c, 8, 40);
        wear_grain(c, frequency, colour, roughness);
    }
    if (cv_chance(c, 0.35f)) {
        float slope = cv_log_range(c, 0.01f, 0.05f + 0.2f * harsh), frequency = cv_log_range(c, 16, 100);
        wear_texture(c, frequency, slope);
    }
}

/* Traffic and polishing wear what faces up, not the flanks of a relief. */
static void roughen_flanks(io_canvas *c, float amount)
{
    int mark = c->used, size = c->size;
    float *steep = cv_plane(c);
    for (int y = 0; y < size; y++) {
        const float *row = c->height + (size_t)y * (size_t)size, *below = y + 1 < size ? row + size : row;
        float *out = steep + (size_t)y * (size_t)size;
        for (int x = 0; x + 1 < size; x++)
            out[x] = (nz_abs(row[x + 1] - row[x]) + nz_abs(below[x] - row[x])) * c->width;
        out[size - 1] = size > 1 ? out[size - 2] : 0;
        for (int x = 0; x < size; x++) out[x] = nz_min(1, 1.5f * out[x]);
    }
    cv_roughen(c, steep, amount);
    cv_drop(c, mark);
}

void wear_calm(io_canvas *c)
{
    float contrast = cv_range(c, 0.35f, 1), rough_contrast = cv_range(c, 0.3f, 1), depth = cv_log_range(c, 0.3f, 1.1f);
    float gloss = cv_chance(c, 0.75f) ? cv_range(c, 0.4f, 1) : 1,
          dark = cv_chance(c, 0.5f) ? cv_log_range(c, 0.25f, 1) : 1;
    float deep_rough = cv_range(c, 0, 0.3f), deep_dark = cv_range(c, 0, 0.3f);
    float *cavity = cv_cavity(c, cv_log_range(c, 0.01f, 0.04f));
    cv_roughen(c, cavity, deep_rough);
    if (cv_chance(c, 0.4f)) roughen_flanks(c, cv_range(c, 0, 0.2f));
    cv_shade(c, cavity, -deep_dark);
    float sum[3] = {0}, rough = 0, weight = 1e-3f; /* of what is not metal, which may be nothing */
    for (int i = 0; i < c->count; i++) {
        float plain = c->specular[1][i] < 0.1f;
        for (int k = 0; k < 3; k++) sum[k] += plain * c->diffuse[k][i];
        weight += plain;
        rough += c->roughness[i];
    }
    rough /= (float)c->count;
    if (rough > 0.65f) gloss = 0.6f + 0.4f * gloss; /* what is matt by nature does not become a lacquer */
    for (int i = 0; i < c->count; i++) {
        float keep = c->specular[1][i] < 0.1f ? contrast : 1;
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = dark * nz_mix(sum[k] / weight, c->diffuse[k][i], keep);
        c->roughness[i] = gloss * (rough + rough_contrast * (c->roughness[i] - rough));
        c->height[i] *= depth;
    }
    cv_drop(c, 0);
}
