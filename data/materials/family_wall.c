/* Plaster, stucco and painted walls; concrete. */
#include "data/materials/family.h"

static const uint32_t wash[] = {0xe8e2d4, 0xd9cfba, 0xcbb894, 0xbfae96, 0xb7a6a0, 0xa9b0ad, 0x8fa0a4, 0x9c8f7a,
                                0xc48f6a, 0xa85f45, 0x7d6a58, 0xd8b878, 0xf0ece2, 0x6f7f74, 0x5c5a58, 0xaa9c88};
static const uint32_t cement[] = {0x9a9790, 0x85837d, 0x6f6d69, 0xb2aea5, 0x5a5956, 0xc4beb2,
                                  0x77726a, 0x8a857a, 0x474645, 0x9c948a, 0x2c2c2d, 0x383634};

/* Thin lines along the borders of large cells, here and there. */
static void cracks(io_canvas *c, float depth)
{
    int mark = c->used;
    float scale = cv_log_range(c, 1, 4), width = cv_log_range(c, 0.004f, 0.02f), least = 0.7f * scale * c->pixel,
          thin = nz_max(width, least);
    nz_frame f = cv_bend(c, cv_frame(c, scale, 1, 0), 1.2f, 5, 0.05f);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    float *where = cv_noise(c, f, NZ_SMOOTH, 0.5f, 2, 0.5f), from = cv_range(c, -0.5f, 0.8f);
    for (int i = 0; i < c->count; i++)
        where[i] = nz_smooth(from, from + 0.5f, where[i]) * nz_smooth(thin, 0, cells.edge[i]) * (width / thin);
    cv_raise(c, where, -depth);
    cv_shade(c, where, -0.8f);
    cv_drop(c, mark);
}

void io_family_plaster(io_canvas *c)
{
    io_rgb a, b;
    pal_pick(c, wash, PAL_COUNT(wash), 0.5f, a);
    pal_vary(c, a, 0.5f, b);
    bool gloss = cv_chance(c, 0.3f);
    io_substance s = pal_dielectric(c, a, gloss ? cv_range(c, 0.25f, 0.55f) : cv_range(c, 0.6f, 1));
    cv_fill(c, &s);
    int kind = ts_rng_int(&c->rng, 4);
    float strong = cv_log_range(c, 0.15f, 1);
    float *relief;
    if (kind == 0) { /* strokes of a trowel in a few directions, the later ones over the earlier */
        relief = cv_plane(c);
        for (int i = 0; i < c->count; i++) relief[i] = 0;
        for (int k = 0; k < 3; k++) {
            int mark = c->used;
            float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1.5f, 4), scale = cv_log_range(c, 2, 6);
            nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.7f, 3, 0.05f);
            float *stroke = cv_noise(c, f, NZ_SMOOTH, 1, 4, 0.5f), *over = cv_noise(c, f, NZ_SMOOTH, 0.6f, 4, 0.5f);
            for (int i = 0; i < c->count; i++)
                relief[i] = nz_mix(relief[i], 0.4f * stroke[i] + 0.5f, nz_smooth(-0.1f, 0.25f, over[i]));
            cv_drop(c, mark);
        }
        cv_raise(c, relief, strong * 0.012f);
    } else if (kind == 1) { /* thrown stucco: blobs flattened on top */
        float scale = cv_log_range(c, 4, 20);
        nz_frame f = cv_frame(c, scale, 1, 0);
        relief = cv_noise(c, f, NZ_SMOOTH, 1, 5, cv_range(c, 0.4f, 0.6f));
        float flat = cv_range(c, 0, 1);
        for (int i = 0; i < c->count; i++)
            relief[i] = nz_mix(relief[i], nz_smooth(-0.3f, 0.6f, relief[i]) + 0.1f * relief[i], flat);
        cv_raise(c, relief, strong * 0.18f / scale);
    } else if (kind == 2) { /* the orange skin of a roller, or grains of sand */
        float scale = cv_log_range(c, 15, 60);
        nz_frame f = cv_frame(c, scale, 1, 0);
        relief = cv_noise(c, f, cv_chance(c, 0.5f) ? NZ_SMOOTH : NZ_BILLOW, 1, 3, 0.5f);
        cv_raise(c, relief, strong * 0.12f / scale);
    } else { /* scraped: grooves torn by coarse grains */
        float turns = cv_range(c, 0, 1), stretch = cv_range(c, 4, 10), scale = cv_log_range(c, 6, 18);
        nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.5f, 3, 0.1f);
        relief = cv_noise(c, f, NZ_SMOOTH, 1, 4, 0.6f);
        float low = cv_range(c, 0.3f, 1);
        for (int i = 0; i < c->count; i++) relief[i] = nz_smooth(low + 0.6f, low, relief[i]) + 0.04f * relief[i];
        cv_raise(c, relief, strong * 0.012f);
    }
    nz_frame soft = cv_frame(c, cv_range(c, 0.8f, 3), 1, 0), f = cv_bend(c, soft, 2, 3, 0.02f);
    float *wave = cv_noise(c, soft, NZ_SMOOTH, 1, 3, 0.4f), *tone = cv_noise(c, f, NZ_SMOOTH, 1, 6, 0.62f);
    cv_raise(c, wave, cv_log_range(c, 0.0005f, 0.006f));
    cv_shade(c, tone, cv_range(c, 0.01f, 0.12f));
    cv_shade(c, relief, cv_range(c, 0, 0.08f));
    cv_roughen(c, tone, cv_range(c, 0, 0.08f));
    for (int i = 0; i < c->count; i++) wave[i] = nz_smooth(-0.5f, 1.5f, tone[i]);
    cv_tint(c, wave, cv_range(c, 0, 0.8f), b);
    if (cv_chance(c, 0.25f)) { /* a coat came off and shows an older one */
        io_rgb under;
        pal_pick(c, wash, PAL_COUNT(wash), 0.6f, under);
        io_substance old = pal_dielectric(c, under, cv_range(c, 0.6f, 1));
        uint32_t seed = cv_seed(c);
        nz_fbm(f, NZ_SMOOTH, cv_range(c, 0.6f, 2), 6, 0.6f, seed, wave);
        for (int i = 0; i < c->count; i++) wave[i] += 0.2f * relief[i];
        cv_threshold(c, wave, cv_level(cv_range(c, 0.05f, 0.5f)), 0.04f);
        cv_cover(c, wave, 1, &old);
        cv_raise(c, wave, -cv_log_range(c, 0.001f, 0.006f));
    }
    if (cv_chance(c, 0.3f)) cracks(c, 0.004f);
    wear_any(c, 0.5f);
}

void io_family_concrete(io_canvas *c)
{
    io_rgb a, b;
    pal_pick(c, cement, PAL_COUNT(cement), 0.6f, a);
    pal_vary(c, a, 0.6f, b);
    bool polished = cv_chance(c, 0.2f);
    io_substance s = pal_dielectric(c, a, polished ? cv_range(c, 0.15f, 0.45f) : cv_range(c, 0.6f, 0.95f));
    cv_fill(c, &s);
    float turns = cv_range(c, 0, 1), tone_scale = cv_log_range(c, 1, 4);
    nz_frame f = cv_bend(c, cv_frame(c, tone_scale, 1, turns), 1, 3, 0.04f);
    float *tone = cv_noise(c, f, NZ_SMOOTH, 1, 7, cv_range(c, 0.55f, 0.75f)), *mask = cv_plane(c);
    cv_shade(c, tone, cv_range(c, 0.05f, 0.2f));
    cv_roughen(c, tone, cv_range(c, 0, 0.08f));
    cv_raise(c, tone, polished ? 0.0003f : cv_log_range(c, 0.0005f, 0.005f));
    for (int i = 0; i < c->count; i++) mask[i] = nz_smooth(0, 1.5f, tone[i]);
    cv_tint(c, mask, cv_range(c, 0, 1), b);
    if (cv_chance(c, 0.6f)) { /* air holes */
        nz_cells cells = cv_cells(c);
        float scale = cv_log_range(c, 6, 25), share = cv_range(c, 0.05f, 0.4f), step = scale * c->pixel;
        uint32_t seed = cv_seed(c);
        nz_cell(cv_frame(c, scale, 1, 0), 1, 0.9f, 0, seed, cells);
        for (int i = 0; i < c->count; i++) {
            float radius = 0.05f + 0.25f * nz_again(cells.id[i], 2) * nz_again(cells.id[i], 2);
            mask[i] = nz_again(cells.id[i], 1) < share
                ? nz_smooth(radius + 0.5f * step, radius - 0.5f * step, cells.near[i])
                : 0;
        }
        cv_raise(c, mask, polished ? -0.0005f : -0.12f / scale);
        cv_shade(c, mask, -cv_range(c, 0.3f, 0.8f));
        cv_roughen(c, mask, 0.2f);
    }
    c->used = 0;
    if (cv_chance(c, 0.35f)) { /* gravel that shows */
        nz_cells cells = cv_cells(c);
        nz_frame place = cv_frame(c, cv_log_range(c, 7, 24), 1, 0);
        float *cover = cv_noise(c, place, NZ_SMOOTH, 0.15f, 4, 0.6f), much = cv_level(cv_range(c, 0.2f, 1)),
              round = cv_range(c, 0.05f, 0.2f);
        nz_cell(place, 1, 0.9f, 0, cv_seed(c), cells);
        for (int i = 0; i < c->count; i++) {
            float inside = nz_smooth(0.04f, 0.04f + round + place.step, cells.edge[i]) *
                nz_smooth(much - 0.1f, much + 0.1f, cover[i]);
            cells.near[i] = inside;
            cells.id[i] = inside * (nz_again(cells.id[i], 1) - 0.45f);
        }
        cv_shade(c, cells.id, cv_range(c, 0.3f, 1.2f));
        cv_roughen(c, cells.near, cv_range(c, -0.3f, 0));
        cv_raise(c, cells.near, polished ? 0 : cv_range(c, 0.03f, 0.18f) * place.step / c->pixel * 0.01f);
        c->used = 0;
    }
    if (cv_chance(c, 0.3f)) { /* the boards or panels of the mould */
        float rows = cv_log_range(c, 1.5f, 8), unit = 1 / rows;
        nz_frame board = cv_frame(c, rows, 1,
                                  cv_chance(c, 0.7f) ? 0.25f * (float)ts_rng_int(&c->rng, 2) : cv_range(c, 0, 1));
        nz_cells cells = cv_cells(c);
        uint32_t seed = cv_seed(c);
        nz_brick(board, (nz_brick_shape){cv_range(c, 2, 20), 0.4f, 1, 0.01f}, seed, cells);
        float step = cv_range(c, 0, 0.02f) * unit;
        for (int i = 0; i < c->count; i++) {
            float seam = nz_smooth(0.02f + board.step, 0, cells.edge[i]);
            c->height[i] += step * cells.id[i] - 0.015f * unit * seam;
            cells.near[i] = 0.4f * (nz_again(cells.id[i], 1) - 0.5f) - 0.5f * seam;
        }
        cv_shade(c, cells.near, cv_range(c, 0.2f, 1));
        c->used = 0;
    }
    if (cv_chance(c, 0.35f)) cracks(c, 0.003f);
    if (cv_chance(c, 0.3f)) { /* water that ran down */
        float narrow = cv_range(c, 5, 12), often = cv_range(c, 5, 14);
        nz_frame down = cv_frame(c, often, narrow, 0);
        float *streak = cv_noise(c, down, NZ_SMOOTH, 1, 4, 0.6f);
        cv_threshold(c, streak, cv_range(c, 0, 1), 0.8f);
        cv_shade(c, streak, cv_range(c, -0.5f, 0.2f));
    }
    float grain_colour = cv_range(c, 0.03f, 0.12f), grain_frequency = cv_range(c, 20, 50);
    wear_grain(c, grain_frequency, grain_colour, 0.03f);
    if (cv_chance(c, 0.07f)) wear_wet(c, cv_range(c, 0.2f, 0.7f));
    wear_any(c, 0.7f);
}
