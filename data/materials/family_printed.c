/* Colours in bold shapes that are independent of the relief: printed and laminated paper, card, wrapping, wallpaper. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static void ink(io_canvas *c, io_rgb out)
{
    static const uint32_t plain[] = {0xf4f2ee, 0xe8e6e0, 0x1a1a1a, 0x2c2a28, 0x101014};
    if (cv_chance(c, 0.4f)) pal_pick(c, plain, PAL_COUNT(plain), 0.2f, out);
    else pal_paint(c, out);
}

/* 1 inside a shape: blots, stripes, dots or blocks. */
static float *shape(io_canvas *c)
{
    const int kind = ts_rng_int(&c->rng, 4);
    const float turns = cv_chance(c, 0.6f) ? 0.25f * (float)ts_rng_int(&c->rng, 4) : cv_range(c, 0, 1),
                scale = cv_log_range(c, 1.5f, 24), share = cv_range(c, 0.15f, 0.6f), loose = cv_range(c, 0, 1);
    if (kind == 0) {
        const nz_frame f = cv_bend(c, cv_frame(c, 1, cv_range(c, 1, 2), turns), 2, 3, 0.1f * loose);
        float *blot = cv_noise(c, f, NZ_SMOOTH, 0.4f * scale, cv_chance(c, 0.5f) ? 1 : 4, 0.5f);
        cv_threshold(c, blot, cv_level(share), 0.01f);
        return blot;
    }
    const nz_frame f = cv_bend(c, cv_frame(c, scale, 1, turns), 0.5f, 2, 0.3f * loose * loose);
    nz_cells cells = cv_cells(c);
    nz_brick_shape block = {.width = 64, .shift = 0.5f, .loose = loose};
    if (kind != 1) block.width = cv_range(c, 0.5f, 6);
    if (kind != 1) block.round = cv_range(c, 0, 0.3f);
    if (kind == 3) nz_cell(f, 1, loose, 0.5f, cv_seed(c), cells);
    else nz_brick(f, block, cv_seed(c), cells);
    const float radius = cv_range(c, 0.15f, 0.45f), inset = cv_range(c, 0.05f, 0.3f);
    float *in = cells.id;
    for (int i = 0; i < c->count; i++) {
        const float drawn = nz_again(cells.id[i], 3) < share + 0.3f,
                    e = kind == 3 ? radius - cells.near[i] : cells.edge[i] - inset;
        in[i] = drawn * nz_smooth(-0.5f * f.step, 0.5f * f.step, e);
    }
    return in;
}

void io_family_printed(io_canvas *c)
{
    io_rgb paper;
    ink(c, paper);
    const float gloss = cv_chance(c, 0.7f) ? cv_range(c, 0.12f, 0.5f) : cv_range(c, 0.4f, 0.9f);
    io_substance body = pal_dielectric(c, paper, gloss);
    cv_fill(c, &body);
    const int layers = 1 + ts_rng_int(&c->rng, 4);
    for (int k = 0; k < layers; k++) {
        io_rgb colour;
        ink(c, colour);
        float *mask = shape(c);
        const float varnish = cv_chance(c, 0.2f) ? cv_range(c, -0.15f, 0.25f) : 0;
        cv_tint(c, mask, 1, colour);
        cv_roughen(c, mask, varnish);
        if (cv_chance(c, 0.08f)) cv_raise(c, mask, cv_range(c, 0.0005f, 0.003f));
        c->used = 0;
    }
    if (cv_chance(c, 0.3f)) { /* a shaded picture */
        const float parts = cv_log_range(c, 1, 6);
        float *shade = cv_noise(c, cv_frame(c, 1, 1, 0), NZ_SMOOTH, parts, 5, 0.5f);
        cv_shade(c, shade, cv_range(c, 0.05f, 0.35f));
        c->used = 0;
    }
    if (cv_chance(c, 0.1f)) { /* foil */
        const io_substance foil = fin_metal(c, gloss);
        float *mask = shape(c);
        cv_cover(c, mask, 1, &foil);
        c->used = 0;
    }
    if (cv_chance(c, 0.7f)) {
        fin_swell(c);
        fin_slope(c, cv_log_range(c, 0.003f, 0.06f));
    }
    if (cv_chance(c, 0.35f)) fin_grain(c, 0.08f);
    if (cv_chance(c, 0.2f)) fin_gloss(c);
    if (cv_chance(c, 0.2f)) wear_smudges(c, 0.08f);
    if (cv_chance(c, 0.15f)) wear_scratches(c, 3 + ts_rng_int(&c->rng, 20), 0.5f, NULL);
}
