/* Rough stone and plaster with grain from 8 to 64 cycles a patch; foam, sponge and pumice. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t rock[] = {0x7b766e, 0x5d5a55, 0x96897a, 0x4a4947, 0xa89c88, 0x3a3a3b, 0x84705c, 0x8b8d8a,
                                0xc9b994, 0xb59a78, 0xd8d2c4, 0x6b5a50, 0x9d6a52, 0xe8e4da, 0x2a2928};

/* One layer of relief: lumps, ridges, chipped faces, trowel strokes or pits. */
static void layer(io_canvas *c, float cycles, float amount)
{
    const int mark = c->used, dice = ts_rng_int(&c->rng, 6);
    const float turns = cv_range(c, 0, 1), stretch = dice == 4 ? cv_range(c, 2, 6) : cv_range(c, 1, 1.5f),
                bend = cv_range(c, 0.05f, 0.3f), gain = cv_range(c, 0.4f, 0.75f), low = cv_range(c, -0.5f, 1);
    const nz_frame f = cv_bend(c, cv_frame(c, cycles, stretch, turns), 0.7f, 2, bend);
    if (dice == 3) fin_facets(c, f, false, 2 * amount / cycles, cv_seed(c));
    else {
        const nz_kind kind = dice == 1 ? NZ_RIDGED : dice == 2 ? NZ_BILLOW : NZ_SMOOTH;
        float *relief = cv_noise(c, f, kind, 0.7f, 4, gain);
        if (dice >= 4)
            for (int i = 0; i < c->count; i++) relief[i] = nz_smooth(low + 0.8f, low, relief[i]) + 0.1f * relief[i];
        cv_raise(c, relief, amount / cycles);
    }
    cv_drop(c, mark);
}

/* Colour that has nothing to do with the relief: clouds, veins, layers, specks; or none at all. */
static void markings(io_canvas *c, const io_rgb base)
{
    const int mark = c->used, dice = ts_rng_int(&c->rng, 6);
    io_rgb second;
    pal_vary(c, base, 1, second);
    if (dice == 0) return;
    const float turns = cv_range(c, 0, 1), stretch = dice == 3 ? cv_range(c, 5, 14) : cv_range(c, 1, 1.6f),
                cycles = dice == 4 ? cv_log_range(c, 15, 60) : cv_log_range(c, 1, 6), gain = cv_range(c, 0.45f, 0.7f),
                edge = cv_range(c, -0.3f, 1.3f), width = cv_range(c, 0.05f, 1.5f), much = cv_range(c, 0.2f, 1);
    const nz_frame f = cv_bend(c, cv_frame(c, cycles, stretch, turns), 0.8f, 3, 0.2f);
    float *where = cv_noise(c, f, dice == 2 ? NZ_RIDGED : NZ_SMOOTH, 1, 5, gain);
    cv_shade(c, where, cv_range(c, 0, 0.15f));
    cv_threshold(c, where, edge, width);
    cv_tint(c, where, much, second);
    cv_roughen(c, where, cv_chance(c, 0.4f) ? cv_range(c, -0.2f, 0.2f) : 0);
    cv_drop(c, mark);
}

void io_family_rough(io_canvas *c)
{
    const io_substance body = fin_dielectric(c, rock, PAL_COUNT(rock), 0.45f, 1);
    cv_fill(c, &body);
    const int layers = 1 + ts_rng_int(&c->rng, 3);
    float cycles = cv_log_range(c, 2, 20);
    for (int k = 0; k < layers; k++) {
        layer(c, cycles, cv_range(c, 0.3f, 1));
        cycles = nz_min(50, cycles * cv_range(c, 1.5f, 4));
    }
    markings(c, body.diffuse);
    fin_relief(c, 0.06f, 0.35f);
    fin_any(c, 0.2f, 0.08f);
}

/* Bubbles cut open or whole: cells of one size into height, and 1 in the holes into hole. */
static void bubbles(io_canvas *c, float scale, bool whole, float share, float *hole)
{
    const int mark = c->used;
    const float stretch = cv_range(c, 1, 1.4f), turns = cv_range(c, 0, 1), jitter = cv_range(c, 0.5f, 1),
                round = cv_range(c, 0.35f, 0.6f);
    const nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.8f, 2, 0.1f);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, jitter, 0.5f, cv_seed(c), cells);
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], r = nz_min(cells.near[i] / (cells.near[i] + cells.edge[i] + 1e-4f), 1);
        const float radius = round * (0.5f + 0.5f * nz_again(id, 1)), d = cells.near[i] / radius;
        if (whole) {
            c->height[i] += (1 - r * r) * (0.4f + 0.3f * id) / scale;
            hole[i] = nz_smooth(0.8f, 1, r);
        } else if (nz_again(id, 2) < share && d < 1) {
            c->height[i] -= radius * (1 - d * d) * 0.9f / scale;
            hole[i] = nz_max(hole[i], nz_smooth(1, 0.75f, d));
        }
    }
    cv_drop(c, mark);
}

void io_family_foam(io_canvas *c)
{
    static const uint32_t kinds[] = {0xd9c25a, 0xe8e4da, 0x4a4b4d, 0x232324, 0x8c8c8a,
                                     0x96897a, 0x6d7f6a, 0xb5aa94, 0x7a8a94, 0xa9794d};
    const io_substance body = fin_dielectric(c, kinds, PAL_COUNT(kinds), 0.5f, 1);
    cv_fill(c, &body);
    const bool whole = cv_chance(c, 0.35f);
    float scale = cv_log_range(c, 5, 24), *hole = cv_plane(c);
    for (int i = 0; i < c->count; i++) hole[i] = 0;
    const int sizes = whole ? 1 : 1 + ts_rng_int(&c->rng, 2);
    for (int k = 0; k < sizes; k++) {
        bubbles(c, scale, whole, cv_range(c, 0.4f, 1), hole);
        scale *= cv_range(c, 1.8f, 3);
    }
    if (cv_chance(c, 0.5f)) cv_shade(c, hole, -cv_range(c, 0.1f, 0.7f));
    if (cv_chance(c, 0.5f)) cv_roughen(c, hole, cv_range(c, -0.2f, 0.2f));
    if (cv_chance(c, 0.4f)) layer(c, scale, 0.2f);
    fin_relief(c, 0.08f, 0.4f);
    fin_any(c, 0.1f, 0.05f);
}
