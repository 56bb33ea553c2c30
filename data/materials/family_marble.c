/* Polished stone: veined marble, banded onyx, granite, terrazzo, in one piece or in slabs. */
#include "data/materials/family.h"

static const uint32_t pale[] = {0xe9e6e0, 0xddd6c9, 0xcfc6b6, 0xb9b2a7, 0xf0eeea, 0xc8b79c, 0x9b9a98, 0x7e7a74,
                                0x4d4a46, 0x2b2a2b, 0x1a1c1e, 0x3b4a42, 0x6b3f35, 0x8a6a55, 0x565b60, 0x20241f};
static const uint32_t vein[] = {0x6f6b66, 0x8d8578, 0x3f3d3c, 0xa78a5c, 0xb5803f, 0xe8e4dc,
                                0xc9c0b0, 0x574a3c, 0x2a2a2c, 0x7b4a32, 0xd8d2c4};

static void veins(io_canvas *c, const io_rgb second)
{
    float bend = cv_range(c, 0.05f, 0.22f), turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 3),
          scale = cv_log_range(c, 0.6f, 2.5f);
    nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.7f, 4, bend);
    float *cloud = cv_noise(c, f, NZ_SMOOTH, 1, 6, 0.6f), *line = cv_plane(c);
    float spread = cv_range(c, 0.1f, 0.5f);
    cv_shade(c, cloud, cv_range(c, 0.03f, 0.25f));
    for (int layer = 0; layer < 3; layer++) {
        io_rgb colour;
        pal_vary(c, second, 0.6f, colour);
        uint32_t seed = cv_seed(c);
        nz_fbm(f, NZ_RIDGED, (float)(1 << layer) * cv_range(c, 0.4f, 0.8f), 3, 0.3f, seed, line);
        float sharp = cv_range(c, 0.06f, 0.3f) + (float)(1 << layer) * f.step, low = 1.25f - spread;
        for (int i = 0; i < c->count; i++) line[i] = nz_smooth(low, low + sharp * 3, line[i] + 0.25f * cloud[i]);
        cv_tint(c, line, cv_range(c, 0.25f, 0.9f), colour);
        cv_roughen(c, line, cv_range(c, -0.03f, 0.1f));
    }
}

static void bands(io_canvas *c, const io_rgb second)
{
    float bend = cv_range(c, 0.06f, 0.2f), turns = cv_range(c, 0, 1), stretch = cv_range(c, 1.5f, 4),
          scale = cv_log_range(c, 0.8f, 2.5f);
    nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.7f, 4, bend);
    float *layer = cv_noise(c, f, NZ_SMOOTH, 0.6f, 3, 0.4f), *mask = cv_plane(c);
    float often = cv_range(c, 1, 4);
    io_rgb third;
    pal_pick(c, vein, PAL_COUNT(vein), 0.5f, third);
    for (int i = 0; i < c->count; i++) mask[i] = 0.5f + 0.5f * nz_sine(layer[i] * often);
    cv_tint(c, mask, 0.9f, second);
    for (int i = 0; i < c->count; i++) mask[i] = nz_smooth(0.4f, 0.95f, nz_sine(layer[i] * often * 2.7f + 0.3f));
    cv_tint(c, mask, cv_range(c, 0.3f, 0.9f), third);
    for (int i = 0; i < c->count; i++) mask[i] = nz_sine(layer[i] * often * 7);
    cv_shade(c, mask, cv_range(c, 0.03f, 0.2f));
    cv_roughen(c, mask, cv_range(c, 0, 0.03f));
}

static void grains(io_canvas *c, const io_rgb second)
{
    float scale = cv_log_range(c, 18, 60), fade = nz_smooth(0.8f, 0.3f, scale * c->pixel);
    nz_frame straight = cv_frame(c, scale, 1, 0), f = cv_bend(c, straight, 0.8f, 3, 0.06f);
    io_rgb third;
    pal_pick(c, vein, PAL_COUNT(vein), 0.6f, third);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    float share = cv_range(c, 0.15f, 0.5f), more = share + cv_range(c, 0.1f, 0.35f);
    float *a = cells.x, *b = cells.y;
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i];
        a[i] = nz_mix(share, id < share, fade);
        b[i] = nz_mix(more - share, id >= share && id < more, fade);
        cells.near[i] = fade * (nz_again(id, 1) - 0.5f);
    }
    cv_tint(c, a, 0.95f, second);
    cv_tint(c, b, 0.95f, third);
    cv_shade(c, cells.near, cv_range(c, 0.2f, 0.8f));
    cv_roughen(c, a, cv_range(c, -0.05f, 0.12f));
    float *fine = cv_noise(c, straight, NZ_SMOOTH, 1, 3, 0.7f);
    cv_shade(c, fine, 0.1f);
}

static void chips(io_canvas *c, const io_rgb second)
{
    float scale = cv_log_range(c, 4, 16), gap = cv_range(c, 0.02f, 0.15f);
    nz_frame f = cv_frame(c, scale, 1, 0);
    nz_cells cells = cv_cells(c);
    io_rgb third;
    pal_pick(c, pale, PAL_COUNT(pale), 0.6f, third);
    for (int layer = 0; layer < 2; layer++) {
        nz_cell(f, layer ? 2.3f : 1, 1, 0, cv_seed(c), cells);
        float share = cv_range(c, 0.3f, 0.8f), size = (layer ? 2.3f : 1) * f.step;
        for (int i = 0; i < c->count; i++) {
            float id = cells.id[i],
                  inside = nz_smooth(gap, gap + 0.03f + size, cells.edge[i]) * (nz_again(id, 1) < share);
            cells.x[i] = inside;
            cells.y[i] = inside * (nz_again(id, 2) < 0.4f);
            cells.near[i] = inside * (nz_again(id, 3) - 0.5f);
        }
        cv_tint(c, cells.x, 1, second);
        cv_tint(c, cells.y, 1, third);
        cv_shade(c, cells.near, 0.7f);
        cv_roughen(c, cells.x, -0.06f);
    }
}

void io_family_marble(io_canvas *c)
{
    io_rgb a, b;
    pal_pick(c, pale, PAL_COUNT(pale), 0.4f, a);
    if (cv_chance(c, 0.6f)) pal_pick(c, vein, PAL_COUNT(vein), 0.5f, b);
    else pal_vary(c, a, 1.2f, b);
    io_substance s = pal_dielectric(c, a, cv_chance(c, 0.75f) ? cv_log_range(c, 0.06f, 0.3f) : cv_range(c, 0.3f, 0.6f));
    cv_fill(c, &s);
    int kind = ts_rng_int(&c->rng, 10);
    (kind < 5 ? veins : kind < 7 ? bands : kind < 9 ? grains : chips)(c, b);
    c->used = 0;
    nz_frame f = cv_frame(c, cv_range(c, 1, 4), 1, 0);
    float *wave = cv_noise(c, f, NZ_SMOOTH, 1, 3, 0.4f);
    cv_raise(c, wave, cv_log_range(c, 0.00005f, 0.002f)); /* no polish is perfectly flat */
    cv_roughen(c, wave, cv_range(c, 0, 0.03f));
    if (cv_chance(c, 0.3f)) { /* slabs with a joint */
        float rows = cv_range(c, 1, 4);
        nz_frame slab = cv_frame(c, rows, 1, cv_chance(c, 0.7f) ? 0 : cv_range(c, 0, 1));
        nz_brick_shape shape = {.loose = 0, .round = 0.01f};
        shape.width = cv_range(c, 1, 2);
        shape.shift = cv_chance(c, 0.5f) ? 0.5f : 0;
        nz_cells cells = cv_cells(c);
        nz_brick(slab, shape, cv_seed(c), cells);
        io_rgb joint = {0.05f, 0.045f, 0.04f};
        io_substance mortar = pal_dielectric(c, joint, 0.8f);
        float gap = cv_range(c, 0.004f, 0.015f), tone = cv_range(c, 0, 0.5f);
        for (int i = 0; i < c->count; i++) {
            wave[i] = nz_smooth(gap + slab.step, gap, cells.edge[i]);
            cells.id[i] -= 0.5f;
        }
        cv_shade(c, cells.id, tone);
        cv_roughen(c, cells.id, cv_range(c, 0, 0.1f));
        cv_cover(c, wave, 1, &mortar);
        cv_raise(c, wave, -0.008f / rows);
    }
    wear_any(c, 0.1f);
}
