/* What is flat and shines: polished stone and glazed tile with F0 up to .2; metals of every kind, bare, rusted,
 * painted. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t slab[] = {0xe8e4da, 0xcfc8ba, 0x2a2928, 0x161617, 0x7b766e, 0x4a5a4c, 0x6b2a20,
                                0x96897a, 0x3a4a5a, 0xb5967a, 0x8b8d8a, 0x5a4a40, 0xd9c9b0, 0x26332c};

/* Veins, clouds or grains of one colour in another, as rock has them, without relief. */
static void figure(io_canvas *c, const io_rgb base)
{
    const int mark = c->used, dice = ts_rng_int(&c->rng, 4);
    io_rgb second;
    if (cv_chance(c, 0.7f)) pal_vary(c, base, 1.2f, second);
    else pal_pick(c, slab, PAL_COUNT(slab), 0.5f, second);
    const float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 3), much = cv_range(c, 0.3f, 1);
    if (dice == 3) { /* granite, terrazzo */
        const float scale = cv_log_range(c, 12, 60), least = cv_range(c, 0.2f, 0.8f), spread = cv_range(c, 0.2f, 1.2f);
        const nz_frame f = cv_bend(c, cv_frame(c, scale, 1, turns), 0.8f, 2, 0.25f);
        nz_cells cells = cv_cells(c);
        nz_cell(f, 1, 1, 0, cv_seed(c), cells);
        for (int i = 0; i < c->count; i++) {
            cells.near[i] = cells.id[i] > least;
            cells.edge[i] = nz_again(cells.id[i], 1) - 0.5f;
        }
        cv_tint(c, cells.near, much, second);
        cv_shade(c, cells.edge, spread);
    } else {
        const float cycles = cv_log_range(c, 0.8f, 4), bend = cv_range(c, 0.1f, 0.6f), gain = cv_range(c, 0.45f, 0.65f),
                    least = cv_range(c, -0.2f, 1.2f), width = cv_range(c, 0.1f, 1);
        const nz_frame f = cv_bend(c, cv_frame(c, cycles, stretch, turns), 0.6f, 4, bend);
        float *vein = cv_noise(c, f, dice ? NZ_RIDGED : NZ_SMOOTH, 1, 6, gain);
        cv_shade(c, vein, cv_range(c, 0, 0.2f));
        cv_threshold(c, vein, least, width);
        cv_tint(c, vein, much, second);
        cv_roughen(c, vein, cv_chance(c, 0.3f) ? cv_range(c, -0.05f, 0.15f) : 0);
    }
    cv_drop(c, mark);
}

void io_family_polished(io_canvas *c)
{
    io_substance body = fin_dielectric(c, slab, PAL_COUNT(slab), 0.05f, 0.35f);
    cv_fill(c, &body);
    if (cv_chance(c, 0.8f)) figure(c, body.diffuse);
    c->used = 0;
    fin_level(c, 0.45f);
    const float unevenness = cv_log_range(c, 0.003f, 0.06f), cycles = cv_range(c, 1, 10);
    nz_frame plain = cv_frame(c, 1, 1, 0);
    float *wave = cv_noise(c, plain, NZ_SMOOTH, cycles, 2, 0.4f);
    cv_raise(c, wave, unevenness / (6.2831853f * cycles));
    if (cv_chance(c, 0.55f)) { /* cut into tiles */
        static const uint32_t grouts[] = {0xb8b0a2, 0x7d7870, 0xe4e0d4, 0x3a3a3b, 0x5c5853};
        const io_substance grout = fin_dielectric(c, grouts, PAL_COUNT(grouts), 0.6f, 1);
        const float rows = cv_log_range(c, 1.5f, 14), turns = cv_chance(c, 0.6f) ? 0 : cv_range(c, 0, 1);
        nz_brick_shape shape = {.width = 1};
        if (cv_chance(c, 0.4f)) shape.width = cv_range(c, 1, 4);
        if (cv_chance(c, 0.4f)) shape.shift = 0.5f;
        shape.round = cv_range(c, 0.01f, 0.1f);
        const nz_frame f = cv_frame(c, rows, 1, turns);
        nz_cells cells = cv_cells(c);
        nz_brick(f, shape, cv_seed(c), cells);
        const float joint = cv_range(c, 0.01f, 0.06f), bevel = cv_range(c, 0.02f, 0.15f) + f.step,
                    depth = cv_range(c, 0.01f, 0.06f) / rows, lean = cv_range(c, 0, 0.08f) / rows,
                    spread = cv_range(c, 0, 0.6f), pillow = cv_chance(c, 0.3f) ? cv_range(c, 0.02f, 0.15f) / rows : 0;
        for (int i = 0; i < c->count; i++) {
            const float id = cells.id[i], t = nz_clamp((cells.edge[i] - joint) / bevel, 0, 1);
            c->height[i] += t * (2 - t) * depth + pillow * cells.edge[i] * (1 - cells.edge[i]) +
                lean * ((nz_again(id, 1) - 0.5f) * cells.x[i] + (nz_again(id, 2) - 0.5f) * cells.y[i]);
            cells.near[i] = nz_smooth(joint + f.step, joint - f.step, cells.edge[i]);
            cells.x[i] = nz_again(id, 3) - 0.5f;
        }
        cv_shade(c, cells.x, spread);
        cv_cover(c, cells.near, 1, &grout);
        c->used = 0;
    }
    if (cv_chance(c, 0.3f)) fin_grain(c, 0.04f);
    if (cv_chance(c, 0.3f)) fin_crevices(c);
    if (cv_chance(c, 0.3f)) wear_smudges(c, 0.08f);
    if (cv_chance(c, 0.2f)) wear_scratches(c, 3 + ts_rng_int(&c->rng, 20), 0.5f, NULL);
    if (cv_chance(c, 0.12f)) fin_coat(c);
}

/* Lines of a brush or lathe, a cast skin, hammer marks, or nothing. */
static void worked(io_canvas *c)
{
    const int mark = c->used, dice = ts_rng_int(&c->rng, 5);
    if (dice == 0) return;
    const float turns = cv_range(c, 0, 1), steep = cv_log_range(c, 0.02f, 0.3f), gain = cv_range(c, 0.4f, 0.9f),
                streak = cv_range(c, 0, 0.12f);
    if (dice == 4) {
        const float scale = cv_log_range(c, 5, 25), bend = cv_range(c, 0.05f, 0.3f);
        const nz_frame f = cv_bend(c, cv_frame(c, scale, 1, turns), 0.6f, 2, bend);
        nz_cells cells = cv_cells(c);
        nz_cell(f, 1, 1, 0, cv_seed(c), cells);
        for (int i = 0; i < c->count; i++) c->height[i] += cells.near[i] * cells.near[i] / scale;
        fin_slope(c, steep);
    } else {
        const float cycles = cv_log_range(c, 6, 60), stretch = dice == 1 ? cv_log_range(c, 10, 60) : 1,
                    scale = dice == 1 ? cycles * 2 : cycles;
        const nz_frame f = cv_frame(c, dice == 1 ? scale : 1, stretch, turns);
        float *lines = cv_noise(c, f, NZ_SMOOTH, dice == 1 ? 0.5f : cycles, 3, gain);
        cv_raise(c, lines, steep / (6.2831853f * cycles));
        cv_roughen(c, lines, streak);
        cv_shade(c, lines, 0.5f * streak);
    }
    cv_drop(c, mark);
}

void io_family_alloy(io_canvas *c)
{
    static const uint32_t oxide[] = {0x6b3a1e, 0x8a4a22, 0x4a2a1a, 0x9c5a2a, 0x3a2c22,
                                     0x4a7a6a, 0x6a9a88, 0x2a2826, 0x5a4a3a};
    const io_substance metal = fin_metal(c, cv_chance(c, 0.6f) ? cv_range(c, 0.12f, 0.5f) : cv_range(c, 0.05f, 0.8f));
    cv_fill(c, &metal);
    worked(c);
    const int over = ts_rng_int(&c->rng,
                                5); /* 0, 1: bare; 2: corroded; 3: painted; 4: another metal inlaid or worn through */
    if (over > 1) {
        io_rgb colour;
        pal_paint(c, colour);
        const float gloss = cv_range(c, 0.08f, 0.9f), share = cv_range(c, 0.1f, 0.85f),
                    cycles = cv_log_range(c, 0.7f, 8), gain = cv_range(c, 0.45f, 0.75f),
                    sharp = over == 3 ? 0.05f : cv_log_range(c, 0.03f, 1), thick = cv_range(c, 0.5f, 4) / 2000,
                    coarse = cv_log_range(c, 10, 40);
        const io_substance layer = over == 2 ? fin_dielectric(c, oxide, PAL_COUNT(oxide), 0.6f, 1)
            : over == 3                      ? pal_dielectric(c, colour, gloss)
                                             : fin_metal(c, gloss);
        const nz_frame f = cv_frame(c, 1, 1, 0);
        float *where = cv_noise(c, f, NZ_SMOOTH, cycles, 6, gain), *bumps = cv_noise(c, f, NZ_BILLOW, coarse, 3, 0.7f);
        cv_threshold(c, where, cv_level(share), sharp);
        cv_cover(c, where, 1, &layer);
        cv_raise(c, where, over == 2 ? 0.5f * thick : thick);
        if (over == 2) {
            for (int i = 0; i < c->count; i++) bumps[i] *= where[i];
            cv_raise(c, bumps, cv_range(c, 0.05f, 0.3f) / (6.2831853f * coarse));
            cv_shade(c, bumps, cv_range(c, 0.05f, 0.3f));
        }
        c->used = 0;
    }
    fin_any(c, 0.08f, 0.1f);
}
