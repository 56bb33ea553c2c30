/* Wood: planks or one board, raw, oiled or varnished; and bark. */
#include "data/materials/family.h"

static const uint32_t timber[] = {0xa9794d, 0x8a5a34, 0x6b4226, 0xc49a6a, 0xd8b98a, 0x4a2e1d, 0x7a4a2a, 0x9c8468,
                                  0x8b8378, 0x6f6a62, 0x5a3020, 0x3a251b, 0xb5693c, 0x2a1c16, 0xe0cfae};
static const uint32_t bark_colours[] = {0x6b5a48, 0x4a3d31, 0x7d6e5c, 0x8a6f52, 0x3a312a, 0x5c5648, 0x93806a, 0x6a4a35};

static void bark(io_canvas *c)
{
    io_rgb a, b, moss = {0.09f, 0.1f, 0.04f};
    pal_pick(c, bark_colours, PAL_COUNT(bark_colours), 0.5f, a);
    pal_vary(c, a, 1, b);
    io_substance s = pal_dielectric(c, a, cv_range(c, 0.65f, 0.95f));
    cv_fill(c, &s);
    float scale = cv_log_range(c, 4, 14);
    float lean = cv_range(c, -0.08f, 0.08f), turns = lean + 0.25f * (float)ts_rng_int(&c->rng, 2),
          stretch = cv_range(c, 2, 6);
    nz_frame plain = cv_frame(c, scale, stretch, turns);
    nz_frame f = cv_bend(c, plain, 0.5f, 4, cv_range(c, 0.03f, 0.12f));
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    float *fibre = cv_noise(c, f, NZ_RIDGED, 1.5f, 5, 0.6f), *plate = cv_plane(c),
          depth = cv_range(c, 0.1f, 0.4f) / scale;
    for (int i = 0; i < c->count; i++) plate[i] = nz_smooth(0, 0.35f, cells.edge[i] + 0.06f * fibre[i]);
    cv_raise(c, plate, depth);
    cv_raise(c, fibre, 0.12f * depth);
    for (int i = 0; i < c->count; i++) cells.near[i] = plate[i] - 0.7f;
    cv_shade(c, cells.near, cv_range(c, 0.4f, 1));
    cv_shade(c, fibre, cv_range(c, 0.08f, 0.25f));
    for (int i = 0; i < c->count; i++) cells.near[i] = nz_smooth(0.5f, 0.8f, cells.id[i]) * plate[i];
    cv_tint(c, cells.near, 0.7f, b);
    cv_roughen(c, fibre, 0.05f);
    if (cv_chance(c, 0.4f)) {
        nz_fbm(plain, NZ_SMOOTH, 0.3f, 6, 0.65f, cv_seed(c), fibre);
        cv_threshold(c, fibre, cv_level(cv_range(c, 0.1f, 0.5f)), 0.4f);
        cv_tint(c, fibre, 0.8f, moss);
    }
    wear_any(c, 0.5f);
}

void io_family_wood(io_canvas *c)
{
    if (cv_chance(c, 0.12f)) {
        bark(c);
        return;
    }
    io_rgb light, dark;
    pal_pick(c, timber, PAL_COUNT(timber), 0.5f, light);
    pal_vary(c, light, 0.3f, dark);
    pal_scale(dark, cv_range(c, 0.25f, 0.65f));
    bool varnish = cv_chance(c, 0.45f);
    io_substance s = pal_dielectric(c, light, varnish ? cv_range(c, 0.12f, 0.45f) : cv_range(c, 0.5f, 0.9f));
    cv_fill(c, &s);

    float rows = cv_chance(c, 0.3f) ? 0.7f : cv_log_range(c, 2, 9), unit = nz_min(1 / rows, 0.25f),
          narrow = nz_min(1, rows / 4); /* a wide board has no wider joints */
    nz_frame f = cv_frame(c, rows, 1, cv_chance(c, 0.5f) ? 0.25f * (float)ts_rng_int(&c->rng, 2) : cv_range(c, 0, 1));
    nz_cells cells = cv_cells(c);
    nz_brick_shape shape = {.round = 0.02f};
    shape.width = cv_range(c, 3, 12);
    shape.shift = cv_range(c, 0.2f, 0.6f);
    shape.loose = cv_chance(c, 0.5f) ? 1 : 0;
    if (cv_chance(c, 0.12f)) shape = (nz_brick_shape){cv_range(c, 1, 2.5f), 0.5f, 0, 0.02f}; /* parquet blocks */
    bool herringbone = rows > 1 && cv_chance(c, 0.12f);
    uint32_t seed = cv_seed(c);
    if (herringbone) nz_herringbone(f, 3 + ts_rng_int(&c->rng, 4), 0.02f, seed, cells);
    else nz_brick(f, shape, seed, cells);

    /* Each plank is cut from another place of the trunk: shift the grain by its number. */
    float *u = cv_plane(c), *v = cv_plane(c), long_grain = cv_range(c, 6, 16);
    float rings_in_patch = cv_range(c, 4, 9), rings = nz_max(cv_range(c, 1.2f, 3.5f), rings_in_patch / rows);
    for (int i = 0; i < c->count; i++) {
        u[i] = (herringbone ? cells.x[i] : f.u[i]) / long_grain + 40 * cells.id[i];
        v[i] = (herringbone ? cells.y[i] : f.v[i]) + 40 * nz_again(cells.id[i], 1);
    }
    nz_frame along = {c->count, u, v, f.step};
    int mark = c->used;
    float *wander = cv_noise(c, along, NZ_SMOOTH, 0.8f, 3, 0.5f), *layer = cv_plane(c),
          wild = cv_log_range(c, 0.05f, 0.5f);
    for (int i = 0; i < c->count; i++) layer[i] = rings * (v[i] + wild * wander[i]);
    if (cv_chance(c, 0.35f)) { /* knots: the rings bend around them */
        nz_cells knot = cv_cells(c);
        nz_frame place = {c->count, cv_plane(c), v, f.step};
        for (int i = 0; i < c->count; i++) place.u[i] = f.u[i] * 0.6f + 40 * cells.id[i];
        seed = cv_seed(c);
        nz_cell(place, cv_range(c, 0.4f, 1), 0.8f, 0, seed, knot);
        float share = cv_range(c, 0.1f, 0.5f), size = cv_range(c, 0.06f, 0.16f);
        for (int i = 0; i < c->count; i++) {
            float d = knot.near[i] / size, here = nz_again(knot.id[i], 1) < share;
            layer[i] = nz_mix(layer[i], d * 2.5f, here / (1 + d * d * d * 0.25f));
            knot.edge[i] = here * nz_smooth(1.1f, 0.5f, d);
        }
        cv_tint(c, knot.edge, 0.75f, dark);
        cv_roughen(c, knot.edge, 0.08f);
        for (int i = 0; i < c->count; i++) wander[i] = layer[i];
        layer = wander;
        mark++;
    } else mark += 2;
    for (int i = 0; i < c->count; i++) { /* early wood light, late wood dark and sharp at its end */
        float t = layer[i] - nz_floor(layer[i]);
        layer[i] = t * t * nz_smooth(1, 0.85f, t) * 1.4f;
    }
    cv_drop(c, mark);
    cv_tint(c, layer, cv_range(c, 0.5f, 1), dark);
    float fine = nz_max(8, cv_log_range(c, 25, 90) / rows), grain_step = f.step * fine;
    for (int i = 0; i < c->count; i++) u[i] = u[i] * 0.5f;
    nz_frame fibre_frame = {c->count, u, v, nz_min(f.step, 0.4f / fine)};
    float *fibre = cv_noise(c, fibre_frame, NZ_SMOOTH, fine, 3, 0.8f),
          *pore = cv_noise(c, along, NZ_SMOOTH, nz_max(cv_range(c, 5, 9), 25 / rows), 3, 0.7f);
    float visible = 1 / (1 + grain_step); /* what remains of fibres narrower than a pixel */
    cv_shade(c, fibre, cv_range(c, 0.06f, 0.3f) * visible);
    cv_raise(c, layer, -cv_range(c, 0, varnish ? 0.003f : 0.02f) * unit);
    cv_raise(c, fibre, cv_log_range(c, 0.0005f, varnish ? 0.002f : 0.008f) * unit * visible);
    cv_threshold(c, pore, cv_range(c, 0.8f, 1.8f), 0.4f);
    cv_shade(c, pore, -cv_range(c, 0.1f, 0.6f));
    cv_raise(c, pore, -0.003f * unit);
    cv_roughen(c, pore, 0.1f);
    cv_roughen(c, layer, cv_range(c, -0.1f, 0.15f));
    float spread = cv_range(c, 0.05f, 0.8f), gap = cv_range(c, 0.003f, 0.02f) * narrow,
          depth = cv_range(c, 0.02f, 0.12f), tilt = cv_range(c, 0, 0.03f) * unit;
    float bevel = cv_range(c, 0.01f, 0.05f) * narrow + 0.5f * f.step, uneven = cv_range(c, 0, 0.03f) * unit;
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i], open = nz_smooth(gap + bevel, gap, cells.edge[i]);
        c->height[i] += (1 - open) * (tilt * (nz_again(id, 4) - 0.5f) * cells.y[i] + uneven * nz_again(id, 6)) -
            open * depth * unit;
        c->roughness[i] += 0.15f * (nz_again(id, 5) - 0.5f) + 0.3f * open;
        pore[i] = spread * (nz_again(id, 3) - 0.5f) - 0.8f * open;
    }
    cv_shade(c, pore, 1);
    if (!herringbone && cv_chance(c, 0.2f) && rows > 1) { /* nails at the ends of the boards */
        io_substance nail = pal_metal(c, cv_range(c, 0.3f, 0.7f));
        float from_end = 0.12f * narrow, radius = cv_range(c, 0.03f, 0.06f) * narrow, soft = 0.01f + f.step;
        for (int i = 0; i < c->count; i++) {
            float x = 0.5f * shape.width - nz_abs(cells.x[i]) - from_end, y = nz_abs(cells.y[i]) - 0.28f,
                  d = x * x + y * y;
            pore[i] = nz_smooth((radius + soft) * (radius + soft), radius * radius, d);
        }
        cv_cover(c, pore, 1, &nail);
        cv_raise(c, pore, -0.01f * unit);
    }
    if (varnish && cv_chance(c, 0.3f)) { /* the coat fills the grain */
        for (int i = 0; i < c->count; i++) c->height[i] *= 0.3f;
    }
    wear_any(c, varnish ? 0.2f : 0.6f);
}
