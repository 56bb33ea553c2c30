/* Bark: furrows and plates along the trunk. Pebbles: rounded stones of several sizes beside and over each other. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

void io_family_bark(io_canvas *c)
{
    static const uint32_t barks[] = {0x6b5a48, 0x4a3d31, 0x7d6e5c, 0x8a6f52, 0x3a312a, 0x5c5648, 0x93806a, 0xcfc8ba};
    const io_substance outer = fin_dielectric(c, barks, PAL_COUNT(barks), 0.6f, 1);
    io_rgb inner;
    pal_vary(c, outer.diffuse, 0.8f, inner);
    pal_scale(inner, cv_range(c, 0.4f, 1.5f));
    cv_fill(c, &outer);
    const float scale = cv_log_range(c, 4, 18), stretch = cv_range(c, 1.5f, 7), lean = cv_range(c, -0.08f, 0.08f),
                turns = lean + 0.25f * (float)ts_rng_int(&c->rng, 2), bend = cv_range(c, 0.05f, 0.25f);
    const nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.5f, 4, bend);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    float *furrow = cv_noise(c, f, NZ_RIDGED, 0.8f, 5, 0.55f), *flake = cv_noise(c, f, NZ_SMOOTH, 1.5f, 4, 0.7f);
    const float plates = cv_range(c, 0, 1), wide = cv_range(c, 0.15f, 0.5f), rim = cv_range(c, 0.05f, 0.4f),
                scaly = cv_range(c, 0, 0.5f), tone = cv_range(c, 0, 0.6f), colour = cv_range(c, 0, 1);
    float *deep = cells.near;
    for (int i = 0; i < c->count; i++) {
        const float e = nz_clamp((cells.edge[i] + 0.08f * flake[i]) / wide, 0, 1), id = cells.id[i];
        const float ridge = nz_smooth(1.6f, -0.6f, furrow[i]),
                    h = nz_mix(ridge, e * (2 - e) * (0.7f + 0.6f * id), plates);
        const float steps = nz_smooth(0, rim, flake[i]) + nz_smooth(0.8f, 0.8f + rim, flake[i]);
        c->height[i] = (h + 0.3f * scaly * steps + 0.06f * flake[i]) / scale;
        deep[i] = 1 - h;
        cells.id[i] = id - 0.5f;
    }
    cv_tint(c, deep, colour, inner);
    cv_shade(c, cells.id, tone);
    cv_shade(c, flake, cv_range(c, 0, 0.25f));
    if (cv_chance(c, 0.3f)) { /* moss and lichen, wherever the furrows are */
        static const uint32_t green[] = {0x4a5230, 0x6d7f5a, 0x9aa58a, 0xb5b58a, 0x3c4a2a};
        const io_substance moss = fin_dielectric(c, green, PAL_COUNT(green), 0.8f, 1);
        c->used = 0;
        const float cycles = cv_log_range(c, 2, 8), edge = cv_level(cv_range(c, 0.1f, 0.5f));
        const nz_frame plain = cv_frame(c, 1, 1, 0);
        float *where = cv_noise(c, plain, NZ_SMOOTH, cycles, 6, 0.7f);
        cv_threshold(c, where, edge, 0.3f);
        cv_cover(c, where, 0.9f, &moss);
        cv_raise(c, where, cv_range(c, 0, 0.15f) / scale);
    }
    fin_relief(c, 0.1f, 0.4f);
    fin_any(c, 0.14f, 0.02f);
}

/* Stones of one size over what lies there already; a share of the cells has one. */
static void layer(io_canvas *c, float scale, float share, const io_rgb *colours, int count, float level)
{
    const int mark = c->used;
    const float stretch = cv_range(c, 1, 1.6f), turns = cv_range(c, 0, 1), bend = cv_range(c, 0.05f, 0.3f),
                high = cv_range(c, 0.25f, 0.5f), flat = cv_range(c, 0, 0.6f), tones = cv_range(c, 0, 0.8f),
                tilt = cv_range(c, 0, 0.4f), speckle = cv_chance(c, 0.4f) ? cv_range(c, 0.05f, 0.3f) : 0,
                rough = cv_range(c, 0, 0.3f);
    const nz_frame straight = cv_frame(c, scale, stretch, turns), f = cv_bend(c, straight, 0.6f, 2, bend);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 0.95f, 0.5f, cv_seed(c), cells);
    float *grain = cv_noise(c, straight, NZ_SMOOTH, 3, 3, 0.8f);
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], r = cells.near[i] / (cells.near[i] + cells.edge[i] + 1e-4f),
                    size = 0.8f + 0.25f * nz_again(id, 1),
                    s = 1 - r * r * (0.35f + 1.3f * cells.near[i]) / (size * size);
        if (s <= 0 || nz_again(id, 2) >= share) continue;
        const float dome = nz_mix(s, 1 - (1 - s) * (1 - s), flat),
                    lean = (nz_again(id, 3) - 0.5f) * cells.x[i] + (nz_again(id, 4) - 0.5f) * cells.y[i],
                    h = (level + high * (0.6f + 0.8f * nz_again(id, 5)) * dome + tilt * lean * s) / scale;
        if (h <= c->height[i]) continue;
        const float *own = colours[(int)(nz_again(id, 6) * (float)count)];
        const float tone = (1 + tones * (nz_again(id, 7) - 0.5f)) * nz_clamp(1 + speckle * grain[i], 0.2f, 2);
        c->height[i] = h;
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = own[k] * tone;
        c->roughness[i] = nz_clamp(c->roughness[i] + rough * (nz_again(id, 8) - 0.5f), 0.03f, 1);
    }
    cv_drop(c, mark);
}

void io_family_pebbles(io_canvas *c)
{
    static const uint32_t stones[] = {0x7b766e, 0x5d5a55, 0x96897a, 0x4a4947, 0xa89c88, 0xd8d2c4, 0x84705c,
                                      0x58606a, 0x8b8d8a, 0x2a2928, 0x9a7a62, 0xc9b994, 0x6b4a3a, 0xe8e4da};
    static const uint32_t soils[] = {0x6b604f, 0x4b4236, 0x8a7d68, 0x3b3a2c, 0x2b2723, 0xc9b994, 0x565048};
    const io_substance soil = fin_dielectric(c, soils, PAL_COUNT(soils), 0.5f, 1);
    cv_fill(c, &soil);
    io_rgb colours[4];
    const int count = 1 + ts_rng_int(&c->rng, 4), sizes = 1 + ts_rng_int(&c->rng, 2);
    for (int k = 0; k < count; k++) pal_pick(c, stones, PAL_COUNT(stones), 0.5f, colours[k]);
    float scale = cv_log_range(c, 6, 26) * (sizes > 1 ? 1.8f : 1);
    const float coarse = cv_log_range(c, 15, 50);
    const nz_frame plain = cv_frame(c, 1, 1, 0);
    float *sand = cv_noise(c, plain, NZ_SMOOTH, coarse, 3, 0.7f);
    cv_raise(c, sand, 0.03f / coarse);
    cv_shade(c, sand, cv_range(c, 0, 0.25f));
    c->used = 0;
    for (int k = 0; k < sizes; k++) {
        layer(c, scale, k + 1 < sizes ? 1 : cv_range(c, 0.35f, 1), (const io_rgb *)colours, count, 0.05f);
        scale *= cv_range(c, 0.35f, 0.6f);
    }
    fin_relief(c, 0.1f, 0.42f);
    fin_any(c, 0.08f, 0.15f);
}
