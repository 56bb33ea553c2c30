/* Tiles with grout: glazed, stone, glass and metal; squares, bonds and hexagons. */
#include "data/materials/family.h"

static const uint32_t glaze[] = {0xe8e4da, 0xf0ede6, 0xd5cdbd, 0xb7a88e, 0x8f9a9c, 0x5f7a80, 0x2f4a58, 0x1d2b35,
                                 0x7b5b45, 0x9c7a56, 0x5d6d4d, 0xa2473a, 0x3c3a38, 0x1a1a1b, 0xc8b07a, 0x6f8f9f};
static const uint32_t grout[] = {0xc9c4ba, 0xa39e95, 0x7c7871, 0x55524d, 0x2f2d2b, 0xdad6cc, 0x8a7d6c};

void io_family_tile(io_canvas *c)
{
    bool metallic = cv_chance(c, 0.12f), stone = !metallic && cv_chance(c, 0.3f);
    float smooth = stone ? cv_range(c, 0.2f, 0.7f) : cv_log_range(c, 0.06f, 0.35f);
    io_rgb a, b, g;
    pal_pick(c, glaze, PAL_COUNT(glaze), 0.5f, a);
    if (cv_chance(c, 0.5f)) pal_vary(c, a, 0.7f, b);
    else pal_pick(c, glaze, PAL_COUNT(glaze), 0.5f, b);
    pal_pick(c, grout, PAL_COUNT(grout), 0.4f, g);
    io_substance first = metallic ? pal_metal(c, smooth + 0.1f) : pal_dielectric(c, a, smooth), second = first,
                 joint = pal_dielectric(c, g, cv_range(c, 0.7f, 1));
    if (metallic)
        for (int k = 0; k < 3; k++) second.specular[k] *= 0.7f;
    else
        for (int k = 0; k < 3; k++) second.diffuse[k] = b[k];
    second.roughness = nz_clamp(first.roughness * cv_range(c, 0.6f, 1.8f), 0.05f, 0.9f);
    cv_fill(c, &first);

    float rows = cv_log_range(c, 2, 14),
          turns = cv_chance(c, 0.45f) ? 0
        : cv_chance(c, 0.3f)          ? 0.125f
                                      : cv_range(c, 0, 1);
    int pattern = ts_rng_int(&c->rng, 5);
    bool hexagons = pattern == 4;
    nz_frame straight = cv_frame(c, rows, hexagons ? 0.8660254f : 1, turns),
             f = cv_bend(c, straight, 0.5f, 2, cv_chance(c, 0.6f) ? 0.002f : cv_range(c, 0.005f, 0.025f));
    nz_cells cells = cv_cells(c);
    if (hexagons) {
        uint32_t seed = cv_seed(c);
        nz_cell(f, 1, cv_chance(c, 0.8f) ? 0 : 0.3f, 0.5f, seed, cells);
    } else {
        nz_brick_shape shape = {.shift = pattern == 3 ? 0.5f : 0};
        shape.width = pattern < 2 ? 1 : cv_range(c, 1.4f, 4);
        shape.loose = pattern == 1 && cv_chance(c, 0.2f) ? 1 : 0;
        shape.round = cv_chance(c, 0.6f) ? 0.02f : cv_range(c, 0.03f, 0.25f);
        bool herringbone = pattern == 3 && cv_chance(c, 0.4f);
        uint32_t seed = cv_seed(c);
        if (herringbone) nz_herringbone(f, 2 + ts_rng_int(&c->rng, 3), shape.round, seed, cells);
        else nz_brick(f, shape, seed, cells);
    }
    float unit = 1 / rows, gap = cv_range(c, 0.012f, 0.06f), bevel = cv_range(c, 0.015f, 0.1f) + 0.5f * straight.step,
          depth = cv_range(c, 0.01f, 0.07f);
    float *edge = cells.edge, *body = cv_plane(c);
    for (int i = 0; i < c->count; i++) body[i] = nz_smooth(gap, gap + bevel, edge[i]);
    cv_raise(c, body, depth * unit);

    bool checks = cv_chance(c, 0.3f);
    float spread = cv_chance(c, 0.5f) ? cv_range(c, 0, 0.1f) : cv_range(c, 0.1f, 0.8f),
          tilt = cv_chance(c, 0.5f) ? cv_range(c, 0, 0.02f) : cv_range(c, 0.02f, 0.12f);
    float dome = cv_chance(c, 0.2f) ? cv_range(c, 0.02f, 0.12f) : 0,
          rough = cv_chance(c, 0.5f) ? 0.05f : cv_range(c, 0.1f, 0.3f), share = cv_range(c, 0, 0.6f);
    float *mix = cv_plane(c);
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i], x = cells.x[i], y = cells.y[i];
        float parity = 0.5f * (nz_floor(f.u[i]) + nz_floor(f.v[i]));
        mix[i] = checks && !hexagons && pattern < 2 ? (parity - nz_floor(parity) > 0.25f) : nz_again(id, 1) < share;
        c->height[i] += unit *
            (tilt * ((nz_again(id, 2) - 0.5f) * x + (nz_again(id, 3) - 0.5f) * y) - dome * (x * x + y * y)) * body[i];
    }
    cv_cover(c, mix, 1, &second);
    for (int i = 0; i < c->count; i++) {
        mix[i] = nz_again(cells.id[i], 4) - 0.5f;
        c->roughness[i] += rough * (nz_again(cells.id[i], 5) - 0.5f);
    }
    cv_shade(c, mix, spread);
    float *cloud = cv_noise(c, f, stone ? NZ_RIDGED : NZ_SMOOTH, cv_log_range(c, 0.3f, 2.5f), 5, 0.6f);
    cv_shade(c, cloud, stone ? cv_range(c, 0.05f, 0.35f) : cv_range(c, 0, 0.12f));
    cv_roughen(c, cloud, stone ? cv_range(c, 0, 0.1f) : cv_range(c, 0, 0.03f));
    if (stone || cv_chance(c, 0.3f)) {
        float *wave = cv_noise(c, f, NZ_SMOOTH, cv_range(c, 1, 4), 4, 0.5f);
        cv_raise(c, wave, cv_log_range(c, 0.001f, 0.015f) * unit);
    }
    if (!stone && cv_chance(c, 0.2f)) { /* crackled glaze */
        int mark = c->used;
        nz_cells crack = cv_cells(c);
        float density = cv_range(c, 3, 7), width = 0.015f + 0.4f * density * straight.step;
        nz_cell(f, density, 1, 0, cv_seed(c), crack);
        for (int i = 0; i < c->count; i++) crack.edge[i] = nz_smooth(width, 0, crack.edge[i]) * 0.015f / width;
        cv_shade(c, crack.edge, -0.5f);
        cv_roughen(c, crack.edge, 0.2f);
        cv_drop(c, mark);
    }
    if (cv_chance(c, 0.2f)) { /* a pattern printed on each tile */
        io_rgb p;
        pal_paint(c, p);
        float petals = (float)(2 + ts_rng_int(&c->rng, 4)), radius = cv_range(c, 0.2f, 0.35f);
        for (int i = 0; i < c->count; i++) {
            float x = cells.x[i], y = cells.y[i], d = x * x + y * y, star = x * x * y * y * petals * 8;
            mix[i] = nz_smooth(0.06f + straight.step, 0, nz_abs(d - radius * radius + star) - 0.02f);
        }
        cv_tint(c, mix, 0.9f, p);
    }
    float thin = nz_max(gap + 0.3f * bevel, 0.25f * straight.step);
    for (int i = 0; i < c->count; i++)
        mix[i] = nz_smooth(thin + 0.5f * straight.step, thin - 0.5f * straight.step, edge[i] + 0.004f * cloud[i]);
    cv_cover(c, mix, 1, &joint);
    wear_any(c, stone ? 0.6f : 0.25f);
    if (cv_chance(c, 0.3f)) wear_dirt(c, 0.15f * unit, cv_range(c, 0, 0.5f));
}
