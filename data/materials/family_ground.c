/* Ground: soil, gravel, sand, cracked mud, moss, leaves, puddles. */
#include "data/materials/family.h"
#include <math.h>

static const uint32_t earth[] = {0x5a4632, 0x3d2f22, 0x6f5a42, 0x8a7355, 0x2b221a, 0x9c8560, 0xb59c72,
                                 0x4a4236, 0x7a6a58, 0x6a4a30, 0xc9b48c, 0x36302a, 0x8f5f3d};
static const uint32_t pebbles[] = {0x7d7870, 0x5a5753, 0x9a9084, 0x3f3d3b, 0xb5aa98,
                                   0x6b5f52, 0x8a6f5a, 0x4d5055, 0xcac3b6};
static const uint32_t green[] = {0x3f4a22, 0x56602c, 0x2c3a1c, 0x6f7a3a, 0x4a4a20, 0x7a7a40, 0x39462e};
static const uint32_t leaves[] = {0x7a4a22, 0x8f5a28, 0x5a3418, 0xa8742f, 0x6b5a2a, 0x3d2a18, 0x95402a, 0x4f5a2a};

/* Stones of one size, lying on what is there. */
static void stones(io_canvas *c, float scale, float share, float high)
{
    int mark = c->used;
    io_rgb a;
    pal_pick(c, pebbles, PAL_COUNT(pebbles), 0.6f, a);
    io_substance stone = pal_dielectric(c, a, cv_range(c, 0.35f, 0.9f));
    nz_frame f = cv_bend(c, cv_frame(c, scale, 1, cv_range(c, 0, 1)), 0.8f, 3, 0.04f);
    nz_cells cells = cv_cells(c);
    uint32_t seed = cv_seed(c);
    nz_cell(f, 1, cv_range(c, 0.6f, 1), 0.5f, seed, cells);
    float gap = cv_range(c, 0.02f, 0.12f), wide = cv_range(c, 0.15f, 0.4f), fade = nz_smooth(0.8f, 0.35f, f.step);
    float *tone = cells.x, *shape = cells.near, *fine = cells.y;
    nz_fbm(f, NZ_SMOOTH, 1.5f, 4, 0.6f, cv_seed(c), fine);
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i], here = nz_again(id, 1) < share, e = nz_clamp((cells.edge[i] - gap) / wide, 0, 1);
        c->height[i] += fade * here * high / scale * (e * (2 - e) * (0.5f + nz_again(id, 2)) + 0.05f * fine[i] * e);
        shape[i] = nz_mix(share * 0.8f, here * nz_smooth(gap, gap + 0.05f + f.step, cells.edge[i]), fade);
        tone[i] = fade * shape[i] * (nz_again(id, 3) - 0.5f + 0.12f * fine[i]);
    }
    cv_cover(c, shape, 1, &stone);
    cv_shade(c, tone, cv_range(c, 0.3f, 1.2f));
    for (int i = 0; i < c->count; i++) tone[i] = fade * shape[i] * (nz_again(cells.id[i], 4) - 0.5f);
    cv_roughen(c, tone, cv_range(c, 0, 0.4f));
    cv_drop(c, mark);
}

/* Pointed ellipses in any direction: leaves and chips of bark. */
static void litter(io_canvas *c)
{
    int mark = c->used;
    nz_cells cells = cv_cells(c);
    float *mask = cv_plane(c), *tone = cv_plane(c);
    for (int layer = 0; layer < 3; layer++) {
        float scale = cv_log_range(c, 4, 11), share = cv_range(c, 0.3f, 0.9f), slim = cv_range(c, 1.8f, 4);
        nz_frame f = cv_frame(c, scale, 1, cv_range(c, 0, 1));
        nz_cell(f, 1, 0.8f, 0, cv_seed(c), cells);
        io_rgb a;
        pal_pick(c, leaves, PAL_COUNT(leaves), 0.5f, a);
        io_substance leaf = pal_dielectric(c, a, cv_range(c, 0.45f, 0.85f));
        for (int i = 0; i < c->count; i++) {
            float id = cells.id[i], turn = nz_again(id, 1), co = nz_sine(turn + 0.25f), si = nz_sine(turn);
            float x = co * cells.x[i] + si * cells.y[i], y = (co * cells.y[i] - si * cells.x[i]) * slim,
                  t = nz_min(1, 4 * x * x);
            float d = nz_abs(y) - 0.45f * (1 - t);
            mask[i] = nz_again(id, 2) < share ? nz_smooth(slim * f.step, -slim * f.step, d) : 0;
            float rib = nz_smooth(0.05f + f.step, 0, nz_abs(y));
            tone[i] = mask[i] * (nz_again(id, 3) - 0.6f + 0.5f * rib);
            c->height[i] += mask[i] / scale *
                (0.05f + 0.12f * (nz_again(id, 4) - 0.5f) * x + 0.1f * y * (nz_again(id, 5) - 0.5f) - 0.02f * rib);
        }
        cv_cover(c, mask, 1, &leaf);
        cv_shade(c, tone, 0.8f);
        cv_drop(c, mark + 7);
    }
    cv_drop(c, mark);
}

void io_family_ground(io_canvas *c)
{
    io_rgb a, b;
    pal_pick(c, earth, PAL_COUNT(earth), 0.6f, a);
    pal_vary(c, a, 0.9f, b);
    io_substance soil = pal_dielectric(c, a, cv_range(c, 0.7f, 1));
    cv_fill(c, &soil);
    float turns = cv_range(c, 0, 1), plain_scale = cv_log_range(c, 1, 4);
    nz_frame plain = cv_frame(c, plain_scale, 1, turns), f = cv_bend(c, plain, 1, 4, 0.03f);
    float lumps = cv_log_range(c, 0.03f, 0.25f) / 6, gain = cv_range(c, 0.48f, 0.62f);
    float *relief = cv_noise(c, f, cv_chance(c, 0.3f) ? NZ_BILLOW : NZ_SMOOTH, 1.5f, 7, gain), *mask = cv_plane(c);
    int kind = ts_rng_int(&c->rng, 10);
    if (kind < 2) { /* rippled sand */
        float often = cv_range(c, 4, 14), wild = cv_range(c, 0.3f, 1.2f);
        float ripple_turns = cv_range(c, 0, 1), ripple_stretch = cv_range(c, 1, 3);
        nz_frame ripple = cv_frame(c, 1, ripple_stretch, ripple_turns);
        nz_fbm(ripple, NZ_SMOOTH, 1.5f, 4, 0.5f, cv_seed(c), mask);
        for (int i = 0; i < c->count; i++) {
            float t = ripple.u[i] * often + wild * mask[i];
            mask[i] = 0.5f + 0.5f * nz_sine(t + 0.12f * nz_sine(t)) + 0.05f * relief[i];
        }
        cv_raise(c, mask, cv_range(c, 0.02f, 0.12f) / often);
        cv_tint(c, mask, cv_range(c, 0, 0.5f), b);
        lumps *= 0.1f;
    } else if (kind < 4) { /* mud cracked by drying, its plates curled */
        const int before = c->used;
        float scale = cv_log_range(c, 2.5f, 9), gap = cv_range(c, 0.02f, 0.06f);
        nz_frame place = cv_bend(c, cv_frame(c, scale, 1, 0), 0.8f, 4, 0.05f);
        nz_cells cells = cv_cells(c);
        nz_cell(place, 1, 0.9f, 0, cv_seed(c), cells);
        float curl = cv_range(c, 0, 0.25f), deep = cv_range(c, 0.05f, 0.2f) / scale;
        for (int i = 0; i < c->count; i++) {
            mask[i] = nz_smooth(gap + 0.04f + place.step, gap, cells.edge[i]);
            c->height[i] += (1 - mask[i]) *
                (deep + curl / scale * 0.5f * cells.near[i] * cells.near[i] + 0.03f / scale * cells.id[i]);
        }
        cv_shade(c, mask, -0.75f);
        lumps *= 0.25f;
        cv_drop(c, before);
    }
    cv_raise(c, relief, lumps);
    for (int i = 0; i < c->count; i++) mask[i] = nz_smooth(-0.8f, 1.2f, relief[i]);
    cv_tint(c, mask, cv_range(c, 0.2f, 0.9f), b);
    float *fine = cv_noise(c, plain, NZ_SMOOTH, cv_range(c, 6, 14), 5, 0.8f);
    cv_shade(c, fine, cv_range(c, 0.08f, 0.3f));
    cv_raise(c, fine, cv_log_range(c, 0.0006f, 0.004f));
    if (kind >= 4) {
        int sizes = 1 + ts_rng_int(&c->rng, 3);
        float scale = cv_log_range(c, 9, 28), all = cv_chance(c, 0.4f) ? 0.9f : cv_range(c, 0.05f, 0.6f);
        for (int k = 0; k < sizes; k++, scale *= 0.55f, all *= 0.6f) stones(c, scale, all, cv_range(c, 0.15f, 0.5f));
    }
    if (cv_chance(c, 0.3f)) litter(c);
    if (cv_chance(c, 0.4f)) { /* moss or grass */
        io_rgb g, h;
        pal_pick(c, green, PAL_COUNT(green), 0.5f, g);
        pal_vary(c, g, 0.8f, h);
        io_substance moss = pal_dielectric(c, g, cv_range(c, 0.75f, 1));
        float tuft_turns = cv_range(c, 0, 1), tuft_stretch = cv_range(c, 1, 3), tufts = cv_log_range(c, 14, 40);
        nz_frame tuft = cv_frame(c, tufts, tuft_stretch, tuft_turns);
        float *blade = cv_noise(c, tuft, NZ_RIDGED, 1, 3, 0.7f);
        uint32_t seed = cv_seed(c);
        nz_fbm(f, NZ_SMOOTH, cv_range(c, 0.4f, 1.5f), 6, 0.6f, seed, mask);
        for (int i = 0; i < c->count; i++) mask[i] += 0.25f * blade[i] - 20 * c->height[i];
        cv_threshold(c, mask, cv_level(cv_range(c, 0.1f, 0.8f)), 0.25f);
        cv_cover(c, mask, 1, &moss);
        for (int i = 0; i < c->count; i++) {
            relief[i] = mask[i] * blade[i];
            c->height[i] += mask[i] * 0.006f;
        }
        cv_shade(c, relief, 0.3f);
        cv_raise(c, relief, 0.0035f);
        for (int i = 0; i < c->count; i++) mask[i] *= nz_smooth(0, 1.2f, fine[i]);
        cv_tint(c, mask, 0.8f, h);
    }
    float *cavity = cv_cavity(c, 0.03f);
    cv_shade(c, cavity, -cv_range(c, 0.1f, 0.6f));
    if (cv_chance(c, 0.15f)) wear_wet(c, cv_range(c, 0.15f, 0.8f));
    wear_any(c, 0.3f);
}
