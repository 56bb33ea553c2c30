#include "data/materials/finish.h"
#include "data/materials/palette.h"
#include "data/materials/weathering.h"
#include <math.h>

void fin_slope(io_canvas *c, float slope)
{
    const int size = c->size, step = size >= 128 ? size / 128 : 1, reach = 2 * step;
    if (size <= reach) return;
    float sum = 0, count = 0, mean = 0;
    for (int y = 0; y + reach < size; y += step)
        for (int x = 0; x + reach < size; x += step) {
            const float *h = c->height + (size_t)y * (size_t)size + (size_t)x;
            const float p = h[reach] - h[0], q = h[(size_t)reach * (size_t)size] - h[0];
            sum += p * p + q * q;
            mean += h[0];
            count += 1;
        }
    const float per = c->width / (float)reach, rms = sqrtf(sum / count) * per;
    if (rms < 1e-6f) return;
    const float scale = slope / rms;
    mean /= count;
    for (int i = 0; i < c->count; i++) c->height[i] = scale * (c->height[i] - mean);
}

void fin_relief(io_canvas *c, float lo, float hi) { fin_slope(c, cv_log_range(c, lo, hi)); }

/* Grain in a new plane, of standard deviation about 1; cycles receives its lowest frequency. */
static float *grain(io_canvas *c, float *cycles)
{
    const float f = cv_log_range(c, 6, 36), gain = cv_range(c, 0.45f, 0.85f), turns = cv_range(c, 0, 1),
                stretch = cv_chance(c, 0.2f) ? cv_log_range(c, 1.5f, 6) : 1;
    const nz_kind kind = cv_chance(c, 0.65f) ? NZ_SMOOTH : cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_BILLOW;
    float *out = cv_plane(c);
    const int mark = c->used;
    const nz_frame frame = cv_frame(c, 1, stretch, turns);
    nz_fbm(frame, kind, f, 3, gain, cv_seed(c), out);
    cv_drop(c, mark);
    *cycles = f *
        sqrtf((1 + 4 * gain * gain + 16 * gain * gain * gain * gain) / (1 + gain * gain + gain * gain * gain * gain));
    return out;
}

void fin_grain(io_canvas *c, float steep)
{
    const int mark = c->used;
    const bool relief = cv_chance(c, 0.85f), colour = cv_chance(c, 0.65f), apart = cv_chance(c, 0.6f);
    float cycles;
    float *shape = grain(c, &cycles);
    if (relief) cv_raise(c, shape, cv_log_range(c, 0.08f, 0.9f) * steep / (6.2831853f * cycles));
    if (apart) shape = grain(c, &cycles);
    if (colour) cv_shade(c, shape, cv_chance(c, 0.7f) ? cv_log_range(c, 0.02f, 0.25f) : -cv_range(c, 0.02f, 0.2f));
    if (cv_chance(c, 0.5f)) cv_roughen(c, shape, cv_range(c, -0.06f, 0.06f));
    cv_drop(c, mark);
}

void fin_facets(io_canvas *c, nz_frame f, bool either, float amount, uint32_t seed)
{
    for (int i = 0; i < c->count; i++) {
        const float u = nz_floor(f.u[i]), v = nz_floor(f.v[i]);
        const int a = (int)u, b = (int)v;
        const bool turned = either && nz_hash(a, b, seed + 1) & 1; /* which diagonal is the fold */
        const float x = turned ? u + 1 - f.u[i] : f.u[i] - u, y = f.v[i] - v;
        const int left = turned ? a + 1 : a, right = turned ? a : a + 1;
        const float p = nz_unit(nz_hash(right, b, seed)), q = nz_unit(nz_hash(left, b + 1, seed));
        const bool low = x + y < 1;
        const float corner = nz_unit(low ? nz_hash(left, b, seed) : nz_hash(right, b + 1, seed));
        const float h = low ? corner + x * (p - corner) + y * (q - corner)
                            : corner + (1 - x) * (q - corner) + (1 - y) * (p - corner);
        c->height[i] += amount * h;
    }
}

void fin_swell(io_canvas *c)
{
    const float cycles = cv_log_range(c, 1, 5), steep = cv_log_range(c, 0.02f, 0.25f), gain = cv_range(c, 0.3f, 0.5f),
                stretch = cv_range(c, 1, 2.5f), turns = cv_range(c, 0, 1);
    const int mark = c->used;
    const nz_kind kind = cv_chance(c, 0.6f) ? NZ_SMOOTH : cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_BILLOW;
    const nz_frame f = cv_bend(c, cv_frame(c, cycles, stretch, turns), 0.7f, 2, 0.1f);
    float *wave = cv_noise(c, f, kind, 1, 2, gain);
    cv_raise(c, wave, steep / (6.2831853f * cycles));
    cv_drop(c, mark);
}

void fin_crevices(io_canvas *c)
{
    static const uint32_t dust[] = {0x2b2620, 0x1c1a18, 0x4d4030, 0x3a3026, 0x6b5c46, 0x8f8470, 0xb8b0a2, 0x353a2a};
    const int mark = c->used;
    const float near = cv_log_range(c, 0.006f, 0.025f), far = near * cv_range(c, 2, 4), wide = cv_range(c, 0, 0.7f),
                u = cv_range(c, 0, 1);
    const float dark = u < 0.35f ? 0 : u < 0.8f ? cv_log_range(c, 0.1f, 0.9f) : -cv_range(c, 0.05f, 0.6f);
    const float v = cv_range(c, 0, 1),
                rough = v < 0.35f ? 0
        : v < 0.7f                ? cv_range(c, 0.02f, 0.25f)
                                  : -cv_range(c, 0.02f, 0.2f);
    const float worn = cv_chance(c, 0.35f) ? cv_range(c, 0.1f, 0.7f) : 0, shine = cv_range(c, 0, 0.3f);
    float *deep = cv_cavity(c, near), *broad = cv_cavity(c, far);
    for (int i = 0; i < c->count; i++) deep[i] = nz_mix(deep[i], broad[i], wide);
    for (int i = 0; i < c->count; i++) broad[i] = nz_max(0, deep[i]);
    if (dark != 0) cv_shade(c, broad, -dark);
    if (rough != 0) cv_roughen(c, broad, rough);
    if (cv_chance(c, 0.25f)) { /* something has settled there */
        io_rgb colour;
        pal_pick(c, dust, PAL_COUNT(dust), 0.6f, colour);
        const io_substance dirt = pal_dielectric(c, colour, cv_range(c, 0.6f, 1));
        const float least = cv_range(c, 0.05f, 0.35f), most = cv_range(c, 0.4f, 1);
        for (int i = 0; i < c->count; i++) broad[i] = nz_smooth(least, least + 0.4f, deep[i]);
        cv_cover(c, broad, most, &dirt);
    }
    if (worn != 0) {
        for (int i = 0; i < c->count; i++) broad[i] = nz_smooth(0.1f, 0.7f, -deep[i]);
        cv_shade(c, broad, worn);
        cv_roughen(c, broad, -shine);
    }
    cv_drop(c, mark);
}

void fin_gloss(io_canvas *c)
{
    const int dice = ts_rng_int(&c->rng, 10);
    if (dice < 5) return;
    float mean = 0;
    for (int i = 0; i < c->count; i++) mean += c->roughness[i];
    mean /= (float)c->count;
    const float keep = dice < 7 ? 0
        : dice < 9              ? 1
                                : cv_range(c, 0, 1),
                level = cv_chance(c, 0.5f) ? mean : cv_range(c, 0.1f, 0.95f);
    for (int i = 0; i < c->count; i++) c->roughness[i] = level + keep * (c->roughness[i] - mean);
    if (dice < 8) return;
    const int mark = c->used;
    nz_frame f = cv_frame(c, 1, 1, 0);
    const float cycles = cv_log_range(c, 1, 12), gain = cv_range(c, 0.4f, 0.7f), much = cv_range(c, 0.03f, 0.15f);
    float *patch = cv_plane(c);
    nz_fbm(f, NZ_SMOOTH, cycles, 4, gain, cv_seed(c), patch);
    if (cv_chance(c, 0.4f)) cv_threshold(c, patch, cv_range(c, -0.5f, 1), 0.15f);
    cv_roughen(c, patch, much);
    cv_drop(c, mark);
}

void fin_level(io_canvas *c, float polished)
{
    const float u = cv_range(c, 0, 1), v = cv_range(c, 0, 1);
    const float f0 = u < polished ? 0.08f + 0.12f * v
        : v < 0.5f                ? 0.04f
        : v < 0.8f                ? 0.03f + 0.02f * cv_range(c, 0, 1)
        : v < 0.9f                ? cv_range(c, 0.02f, 0.03f)
                                  : cv_log_range(c, 0.05f, 0.08f);
    const float more = f0 / 0.04f - 1;
    for (int i = 0; i < c->count; i++) {
        const float plain = nz_smooth(0.3f, 0.1f, c->specular[1][i]), factor = 1 + plain * more;
        for (int k = 0; k < 3; k++) c->specular[k][i] *= factor;
    }
}

static void smooth_noise(io_canvas *c, float cycles, int octaves, float *out)
{
    const int mark = c->used;
    const nz_frame f = cv_frame(c, 1, 1, 0);
    nz_fbm(f, NZ_SMOOTH, cycles, octaves, 0.5f, cv_seed(c), out);
    cv_drop(c, mark);
}

void fin_coat(io_canvas *c)
{
    const int mark = c->used;
    const bool water = cv_chance(c, 0.25f), whole = !water && cv_chance(c, 0.65f);
    const float f0 = water ? 0.022f : cv_range(c, 0.04f, 0.05f), gloss = cv_log_range(c, 0.05f, water ? 0.12f : 0.35f),
                thick = cv_log_range(c, 0.004f, 0.04f), fill = cv_range(c, 0.1f, 1), deepen = cv_range(c, 0.5f, 1);
    float *mask = cv_cavity(c, cv_log_range(c, 0.01f, 0.05f)), *patch = cv_plane(c), *level = cv_plane(c);
    if (whole)
        for (int i = 0; i < c->count; i++) mask[i] = 1;
    else {
        const float pull = water ? cv_range(c, 0.5f, 2) : cv_range(c, -0.5f, 0.3f), edge = cv_range(c, -0.6f, 0.8f),
                    cycles = cv_log_range(c, 0.7f, 3);
        smooth_noise(c, cycles, 4, patch);
        for (int i = 0; i < c->count; i++) mask[i] = nz_smooth(edge - 0.15f, edge + 0.15f, patch[i] + pull * mask[i]);
    }
    int pixels = (int)(thick * c->width + 0.5f);
    nz_blur(c->size, pixels < 1 ? 1 : pixels, c->height, level, patch);
    for (int i = 0; i < c->count; i++) {
        const float t = mask[i], plain = nz_smooth(0.25f, 0.1f, c->specular[1][i]), dark = 1 - t * plain * (1 - deepen);
        for (int k = 0; k < 3; k++) {
            c->diffuse[k][i] *= dark;
            c->specular[k][i] += t * plain * (f0 - c->specular[k][i]);
        }
        c->roughness[i] += t * (gloss - c->roughness[i]);
        c->height[i] += t * fill * (level[i] - c->height[i]);
    }
    if (cv_chance(c, 0.3f)) { /* the skin of an orange, that sprayed lacquer has */
        const float cycles = cv_log_range(c, 15, 50);
        smooth_noise(c, cycles, 2, level);
        for (int i = 0; i < c->count; i++) level[i] *= mask[i];
        cv_raise(c, level, cv_log_range(c, 0.01f, 0.06f) / (6.2831853f * cycles));
    }
    cv_drop(c, mark);
}

void fin_any(io_canvas *c, float steep, float coat)
{
    cv_drop(c, 0);
    if (cv_chance(c, 0.45f)) fin_swell(c);
    if (cv_chance(c, 0.75f)) fin_grain(c, steep);
    if (cv_chance(c, 0.25f)) wear_stains(c, cv_range(c, 0.2f, 0.8f));
    fin_crevices(c);
    fin_gloss(c);
    if (cv_chance(c, 0.1f)) wear_scratches(c, 2 + ts_rng_int(&c->rng, 12), 0.4f, NULL);
    fin_level(c, 0.12f);
    if (cv_chance(c, coat)) fin_coat(c);
}

io_substance fin_metal(io_canvas *c, float roughness)
{
    /* F0 by optical constants: gold, copper, brass, bronze, silver, aluminium, iron, steel, chromium, titanium, nickel,
     * platinum, zinc, tin, tungsten, cobalt. */
    static const float table[][3] = {
        {1.00f, 0.77f, 0.34f}, {0.96f, 0.64f, 0.54f}, {0.91f, 0.78f, 0.42f}, {0.80f, 0.58f, 0.40f},
        {0.97f, 0.96f, 0.92f}, {0.91f, 0.92f, 0.92f}, {0.56f, 0.57f, 0.58f}, {0.62f, 0.60f, 0.57f},
        {0.55f, 0.56f, 0.55f}, {0.54f, 0.50f, 0.45f}, {0.66f, 0.61f, 0.53f}, {0.67f, 0.64f, 0.59f},
        {0.66f, 0.69f, 0.72f}, {0.74f, 0.70f, 0.67f}, {0.50f, 0.51f, 0.54f}, {0.66f, 0.66f, 0.63f}};
    const float *f0 = table[ts_rng_int(&c->rng, PAL_COUNT(table))];
    const float clean = cv_chance(c, 0.65f) ? cv_range(c, 0.85f, 1) : cv_log_range(c, 0.25f, 0.9f),
                reddened = cv_range(c, 0, 0.35f), warm = cv_range(c, -0.03f, 0.06f) + (1 - clean) * reddened;
    const float dust = cv_chance(c, 0.6f) ? 0 : cv_log_range(c, 0.001f, 0.05f);
    return (io_substance){
        {dust, dust, dust},
        {nz_min(1, f0[0] * clean), nz_min(1, f0[1] * clean * (1 - 0.4f * warm)), nz_min(1, f0[2] * clean * (1 - warm))},
        roughness};
}

io_substance fin_dielectric(io_canvas *c, const uint32_t *colours, int count, float lo, float hi)
{
    io_rgb colour;
    if (cv_chance(c, 0.85f)) pal_pick(c, colours, count, 0.6f, colour);
    else pal_paint(c, colour);
    const float roughness = cv_chance(c, 0.75f) ? cv_range(c, lo, hi) : cv_range(c, 0.05f, 0.95f);
    return (io_substance){{colour[0], colour[1], colour[2]}, {0.04f, 0.04f, 0.04f}, roughness};
}
