/* Skins: leather of fine cells and creases; scales that overlap. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t dyed[] = {0x3b2418, 0x5a3520, 0x7a4a2c, 0x9c6a42, 0x1a1614, 0x2b1a14, 0x6b2a20, 0x4a1a18,
                                0xb58a60, 0xd6c4a8, 0x2a2f3a, 0x3a4034, 0x8a8278, 0xe4dccc, 0x181a20};

void io_family_hide(io_canvas *c)
{
    const io_substance skin = fin_dielectric(c, dyed, PAL_COUNT(dyed), 0.25f, 0.7f);
    cv_fill(c, &skin);
    const float scale = cv_log_range(c, 10, 60), turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 2);
    const nz_frame straight = cv_frame(c, scale, stretch, turns);
    const float bend = cv_range(c, 0.1f, 0.5f);
    const nz_frame f = cv_bend(c, straight, 0.35f, 3, bend);
    nz_cells cells = cv_cells(c);
    const float jitter = cv_range(c, 0.7f, 1);
    nz_cell(f, 1, jitter, 0, cv_seed(c), cells);
    const float wide = cv_range(c, 0.1f, 0.45f), own = cv_range(c, 0, 0.7f), fine = cv_range(c, 0, 0.25f),
                pores = cv_chance(c, 0.3f) ? cv_range(c, 0.1f, 0.4f) : 0,
                tones = cv_chance(c, 0.3f) ? cv_range(c, 0.1f, 0.5f) : 0;
    float *wrinkle = cv_noise(c, straight, NZ_RIDGED, 1.6f, 2, 0.6f), *tone = cv_plane(c);
    for (int i = 0; i < c->count; i++) {
        const float e = nz_clamp((cells.edge[i] + 0.03f * wrinkle[i]) / wide, 0, 1), id = cells.id[i];
        const float pit = id < pores ? nz_smooth(0.25f, 0.1f, cells.near[i]) : 0;
        c->height[i] = (e * (2 - e) * (1 + own * (id - 0.5f)) - fine * wrinkle[i] - pit) / scale;
        tone[i] = e > 0 ? id - 0.5f : 0;
    }
    if (tones > 0) cv_shade(c, tone, tones);
    c->used = 0;
    if (cv_chance(c, 0.65f)) { /* creases between fields of cells */
        const float often = cv_log_range(c, 1.5f, 7), long_by = cv_range(c, 1, 3), along = cv_range(c, 0, 1),
                    thin = cv_range(c, 0.3f, 1), depth = cv_log_range(c, 0.3f, 2.5f);
        const nz_frame large = cv_bend(c, cv_frame(c, often, long_by, along), 1, 3, 0.08f);
        float *crease = cv_noise(c, large, NZ_RIDGED, 1, 4, 0.5f);
        for (int i = 0; i < c->count; i++) crease[i] = nz_smooth(1.35f - thin, 1.45f, crease[i]);
        cv_raise(c, crease, -depth / scale);
        c->used = 0;
    }
    fin_relief(c, 0.05f, 0.3f);
    if (cv_chance(c, 0.4f)) { /* soft hide lies in waves */
        const float waves = cv_range(c, 1, 4), steep = cv_range(c, 0.02f, 0.12f);
        const nz_frame large = cv_frame(c, 1, 1, 0);
        float *wave = cv_noise(c, large, NZ_SMOOTH, waves, 2, 0.4f);
        cv_raise(c, wave, steep / (6.2831853f * waves));
        c->used = 0;
    }
    fin_any(c, 0.07f, 0.15f);
}

void io_family_scales(io_canvas *c)
{
    static const uint32_t hue[] = {0x4a5240, 0x6d7f6a, 0x8c8c8a, 0x3a3a3b, 0x7a6a50,
                                   0x5a3a28, 0x9d5a42, 0x2d3a4c, 0x6a6b6d, 0xa89c88};
    const bool metal = cv_chance(c, 0.2f);
    const float gloss = cv_range(c, 0.15f, 0.5f);
    const io_substance body = metal ? fin_metal(c, gloss) : fin_dielectric(c, hue, PAL_COUNT(hue), 0.15f, 0.8f);
    io_rgb second;
    pal_vary(c, body.diffuse, 0.8f, second);
    cv_fill(c, &body);
    const float rows = cv_log_range(c, 4, 26), stretch = cv_range(c, 0.6f, 1.4f),
                turns = cv_chance(c, 0.4f) ? 0.25f * (float)ts_rng_int(&c->rng, 4) : cv_range(c, 0, 1);
    const nz_frame straight = cv_frame(c, rows, stretch, turns);
    const float bend = cv_range(c, 0, 0.2f);
    const nz_frame f = cv_bend(c, straight, 0.3f, 3, bend);
    const float reach = cv_range(c, 1.1f, 1.7f), half = cv_range(c, 0.5f, 0.62f), square = cv_range(c, 0, 1),
                keel = cv_chance(c, 0.4f) ? cv_range(c, 0.05f, 0.3f) : 0, dome = cv_range(c, 0, 0.4f),
                lift = cv_range(c, 0.1f, 0.5f), own = cv_range(c, 0, 0.4f);
    const uint32_t seed = cv_seed(c);
    float *id = cv_plane(c), *mark = cv_plane(c);
    for (int i = 0; i < c->count; i++) {
        const float row = nz_floor(f.v[i]);
        float x = 0, y = 0, number = 0;
        for (int k = 1; k >= 0; k--) { /* the scale of the highest row that reaches here lies on top */
            const float r = row + (float)k, shift = (int)r & 1 ? 0.5f : 0, column = nz_floor(f.u[i] - shift);
            x = (f.u[i] - shift - column - 0.5f) / half;
            y = (r + 1 - f.v[i]) / reach; /* 0 at the root, 1 at the tip */
            number = nz_unit(nz_hash((int)column, (int)r, seed));
            const float x2 = x * x, tip = nz_mix(x2, x2 * x2, square);
            if (y + 0.5f * tip < 1 && x2 < 1) break;
        }
        const float edge = 1 - x * x;
        c->height[i] = ((lift + own * (number - 0.5f)) * y + dome * edge + keel * nz_max(0, 1 - 4 * nz_abs(x)) +
                        0.1f * own * x * (number - 0.5f)) /
            rows;
        id[i] = number;
        mark[i] = y;
    }
    const float tones = cv_range(c, 0, 0.7f), tips = cv_range(c, -0.6f, 0.6f), share = cv_range(c, 0, 1);
    for (int i = 0; i < c->count; i++) {
        const float t = share * nz_again(id[i], 1);
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = nz_mix(c->diffuse[k][i], second[k], t);
        id[i] = tones * (nz_again(id[i], 2) - 0.5f) + tips * (mark[i] - 0.5f);
    }
    cv_shade(c, id, metal ? 0.4f : 1);
    fin_relief(c, 0.08f, 0.35f);
    fin_any(c, 0.06f, 0.12f);
}
