/* Cobbles, rubble walls, flagstones: stones of any shape with sand, mortar or moss between them. */
#include "data/materials/family.h"

static const uint32_t stone[] = {0x7b766e, 0x5d5a55, 0x96897a, 0x4a4947, 0x6b5f52, 0xa89c88,
                                 0x3a3a3b, 0x84705c, 0x58606a, 0x8b8d8a, 0x2a2928, 0x9a7a62};
static const uint32_t filling[] = {0x6b604f, 0x4b4236, 0x8a7d68, 0x3b3a2c, 0x2b2723, 0x9c968a, 0x4a5230, 0x565048};

void io_family_paving(io_canvas *c)
{
    io_rgb a, b, d;
    pal_pick(c, stone, PAL_COUNT(stone), 0.7f, a);
    pal_vary(c, a, 0.9f, b);
    pal_pick(c, filling, PAL_COUNT(filling), 0.6f, d);
    io_substance body = pal_dielectric(c, a, cv_range(c, 0.3f, 0.9f)),
                 sand = pal_dielectric(c, d, cv_range(c, 0.75f, 1));
    cv_fill(c, &body);

    float rows = cv_log_range(c, 2, 9), unit = 1 / rows;
    bool coursed = cv_chance(c, 0.5f);
    float turns = cv_range(c, 0, 1), stretch = coursed ? 1 : cv_range(c, 0.8f, 1.8f);
    nz_frame straight = cv_frame(c, rows, stretch, turns);
    float bend = cv_range(c, 0.015f, 0.07f), bend_frequency = cv_range(c, 0.5f, 1.2f);
    nz_frame f = cv_bend(c, straight, bend_frequency, 3, bend);
    nz_cells cells = cv_cells(c);
    if (coursed) {
        nz_brick_shape shape = {.shift = 0.5f};
        shape.width = cv_range(c, 0.9f, 1.9f);
        shape.loose = cv_chance(c, 0.5f) ? 1 : 0.2f;
        shape.round = cv_range(c, 0.1f, 0.45f);
        if (cv_chance(c, 0.15f)) nz_herringbone(f, 2, shape.round, cv_seed(c), cells);
        else nz_brick(f, shape, cv_seed(c), cells);
    } else {
        uint32_t seed = cv_seed(c);
        float stagger = cv_chance(c, 0.5f) ? 0.5f : 0, jitter = cv_range(c, 0.5f, 1);
        nz_cell(f, 1, jitter, stagger, seed, cells);
    }

    float gap = cv_range(c, 0.03f, 0.12f), bevel = cv_range(c, 0.06f, 0.35f), depth = cv_range(c, 0.05f, 0.28f),
          flat = cv_range(c, 0, 0.6f);
    float grain_gain = cv_range(c, 0.45f, 0.6f), grain_frequency = cv_range(c, 1, 3);
    float *grain = cv_noise(c, f, NZ_SMOOTH, grain_frequency, 6, grain_gain), *top = cv_plane(c);
    float lumpy = cv_log_range(c, 0.004f, 0.035f) * unit, tilt = cv_range(c, 0, 0.12f) * unit,
          uneven = cv_range(c, 0, 0.06f) * unit;
    for (int i = 0; i < c->count; i++) {
        float e = nz_clamp((cells.edge[i] - gap) / bevel + 0.1f * grain[i] * 0.3f, 0, 1), dome = e * (2 - e),
              id = cells.id[i];
        top[i] = nz_smooth(gap, gap + 0.04f + 0.6f * straight.step, cells.edge[i] + 0.01f * grain[i]);
        float h = depth * unit * nz_mix(dome, nz_smooth(0, 0.4f, e), flat) + lumpy * grain[i] + uneven * id;
        c->height[i] = top[i] *
            (h + tilt * ((nz_again(id, 1) - 0.5f) * cells.x[i] + (nz_again(id, 2) - 0.5f) * cells.y[i]));
    }
    float spread = cv_range(c, 0.1f, 0.9f), second = cv_range(c, 0, 1), rough = cv_range(c, 0, 0.25f);
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i], t = second * nz_smooth(0.2f, 0.9f, nz_again(id, 3) + 0.1f * grain[i]),
              tone = 1 + spread * (nz_again(id, 4) - 0.5f);
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = nz_mix(c->diffuse[k][i], b[k], t) * tone;
        c->roughness[i] += rough * (nz_again(id, 5) - 0.5f);
    }
    cv_shade(c, grain, cv_range(c, 0.08f, 0.3f));
    cv_roughen(c, grain, cv_range(c, 0, 0.08f));
    float *fine = cv_noise(c, straight, NZ_SMOOTH, cv_range(c, 6, 14), 4, 0.7f);
    cv_shade(c, fine, cv_range(c, 0.05f, 0.18f));
    cv_raise(c, fine, cv_range(c, 0.001f, 0.005f) * unit);
    if (cv_chance(c, 0.4f)) { /* trodden smooth on top */
        float *worn = cv_plane(c), less = cv_range(c, 0.1f, 0.4f);
        for (int i = 0; i < c->count; i++)
            worn[i] = nz_smooth(0.3f, 0.9f, cells.edge[i] / (gap + bevel) - 0.2f) * top[i];
        cv_roughen(c, worn, -less);
    }
    for (int i = 0; i < c->count; i++) top[i] = 1 - top[i];
    cv_cover(c, top, 1, &sand);
    for (int i = 0; i < c->count; i++) top[i] *= fine[i];
    cv_shade(c, top, 0.2f);
    cv_raise(c, top, 0.008f * unit);
    wear_dirt(c, 0.2f * unit, cv_range(c, 0, 0.7f));
    if (cv_chance(c, 0.12f)) wear_wet(c, cv_range(c, 0.2f, 0.9f));
    wear_any(c, 0.5f);
}
