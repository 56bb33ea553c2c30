/* Natural rock: strata, fractures, pits, lichen. */
#include "data/materials/family.h"

static const uint32_t rock[] = {0x8a857c, 0x6f6a63, 0x57534d, 0x3f3d3a, 0x9a8f7e, 0xb3a68f, 0x7b6a58, 0x5c4b3e,
                                0x4b4f52, 0x2e2f30, 0x8b7a69, 0xc2b9a8, 0x6a5a3a, 0x70604a, 0x45423a, 0x94705a};
static const uint32_t lichen[] = {0x9aa07a, 0xc9c7a0, 0xb99a3a, 0x6f7a4a, 0xdad8c8, 0xa8622a, 0x3f4a2c};

void io_family_stone(io_canvas *c)
{
    io_rgb a, b, d;
    pal_pick(c, rock, PAL_COUNT(rock), 0.7f, a);
    pal_vary(c, a, 0.9f, b);
    if (cv_chance(c, 0.5f)) pal_pick(c, rock, PAL_COUNT(rock), 0.7f, d);
    else pal_vary(c, b, 1.0f, d);
    io_substance s = pal_dielectric(c, a, cv_range(c, 0.45f, 0.95f));
    cv_fill(c, &s);

    float scale = cv_log_range(c, 1, 4), stretch = cv_chance(c, 0.4f) ? cv_range(c, 1.5f, 5) : 1,
          turns = cv_range(c, 0, 1);
    nz_frame plain = cv_frame(c, scale, stretch, turns), bent = cv_bend(c, plain, 0.8f, 3, cv_range(c, 0.01f, 0.1f));
    float slope = cv_log_range(c, 0.08f, 0.45f) / (5 * scale);
    int dice = ts_rng_int(&c->rng, 8), shape = dice < 1 ? 0 : dice < 2 ? 1 : dice < 6 ? 2 : 3;
    float gain = cv_range(c, 0.42f, 0.56f);
    float *relief = cv_noise(c, bent, shape == 0 ? NZ_RIDGED : shape == 1 ? NZ_BILLOW : NZ_SMOOTH, 1, 7, gain);
    if (shape == 3) { /* steps: layers broken off one by one */
        float steps = cv_range(c, 1, 3);
        for (int i = 0; i < c->count; i++) {
            float t = relief[i] * steps, whole = nz_floor(t), rest = t - whole;
            relief[i] = (whole + nz_smooth(0.35f, 1, rest) + 0.15f * rest) / steps;
        }
    }
    cv_raise(c, relief, slope);
    float *fine = cv_noise(c, bent, NZ_SMOOTH, cv_range(c, 6, 14), 5, 0.6f);
    cv_raise(c, fine, slope * cv_range(c, 0.01f, 0.06f));

    float *cut = cv_plane(c);
    float bias = cv_range(c, -0.6f, 0.6f), with_height = cv_range(c, -0.7f, 0.9f);
    float *tone = cv_noise(c, bent, NZ_SMOOTH, cv_log_range(c, 0.5f, 2), 5, 0.55f);
    for (int i = 0; i < c->count; i++) cut[i] = tone[i] + with_height * relief[i];
    cv_threshold(c, cut, bias, cv_range(c, 0.3f, 1.5f));
    cv_tint(c, cut, 1, b);
    uint32_t seed = cv_seed(c);
    nz_fbm(bent, NZ_SMOOTH, cv_log_range(c, 1, 5), 5, 0.65f, seed, tone);
    for (int i = 0; i < c->count; i++) cut[i] = tone[i] - 0.3f * relief[i];
    float blur = cv_range(c, 0.1f, 0.8f), edge = cv_range(c, 0, 1.2f);
    cv_threshold(c, cut, edge, blur);
    cv_tint(c, cut, cv_range(c, 0.3f, 1), d);
    cv_roughen(c, cut, cv_range(c, -0.25f, 0.2f));
    cv_shade(c, fine, cv_range(c, 0.05f, 0.25f));
    cv_roughen(c, fine, cv_range(c, 0, 0.06f));

    if (cv_chance(c, 0.35f)) { /* fractures */
        int mark = c->used;
        nz_cells cells = cv_cells(c);
        float f = cv_log_range(c, 0.6f, 2.5f), width = cv_range(c, 0.01f, 0.05f) + 0.5f * f * plain.step;
        nz_cell(bent, f, 1, 0, cv_seed(c), cells);
        for (int i = 0; i < c->count; i++) cells.edge[i] = -cells.edge[i];
        cv_threshold(c, cells.edge, -width, width);
        cv_raise(c, cells.edge, -slope * cv_range(c, 0.1f, 0.6f));
        for (int i = 0; i < c->count; i++) c->height[i] += slope * 0.7f * (cells.id[i] - 0.5f);
        cv_drop(c, mark);
    }
    if (cv_chance(c, 0.25f)) { /* pits, or grains of mica that shine */
        int mark = c->used;
        bool mica = cv_chance(c, 0.4f);
        float *spot = cv_noise(c, plain, NZ_SMOOTH, cv_log_range(c, 5, 20), 2, 0.5f);
        cv_threshold(c, spot, cv_level(cv_range(c, 0.03f, 0.2f)), 0.3f);
        if (mica) cv_roughen(c, spot, -0.4f);
        else cv_raise(c, spot, -slope * 0.08f);
        cv_shade(c, spot, cv_range(c, -0.7f, 0.5f));
        cv_drop(c, mark);
    }
    float *cavity = cv_cavity(c, cv_log_range(c, 0.015f, 0.06f));
    cv_shade(c, cavity, -cv_range(c, 0.1f, 0.6f));
    cv_roughen(c, cavity, cv_range(c, -0.1f, 0.2f));
    if (cv_chance(c, 0.3f)) {
        io_rgb l;
        pal_pick(c, lichen, PAL_COUNT(lichen), 0.5f, l);
        seed = cv_seed(c);
        nz_fbm(bent, NZ_SMOOTH, cv_log_range(c, 0.8f, 4), 6, 0.65f, seed, tone);
        for (int i = 0; i < c->count; i++) tone[i] += 0.4f * relief[i];
        cv_threshold(c, tone, cv_level(cv_range(c, 0.05f, 0.5f)), 0.25f);
        cv_tint(c, tone, cv_range(c, 0.5f, 1), l);
        cv_roughen(c, tone, 0.15f);
        cv_raise(c, tone, slope * 0.03f);
    }
    if (cv_chance(c, 0.08f)) wear_wet(c, cv_range(c, 0.2f, 0.9f));
}
