/* Coats of paint over metal, wood or wall, with chips, primer, stripes and marks. */
#include "data/materials/family.h"

/* Bands, chevrons, blocks or signs of another colour: 1 where it is. */
static void stencil(io_canvas *c, float *mask)
{
    int mark = c->used, kind = ts_rng_int(&c->rng, 4);
    float often = cv_log_range(c, 1, 6), wide = cv_range(c, 0.25f, 0.6f),
          turns = cv_chance(c, 0.5f) ? 0.125f : 0.25f * (float)ts_rng_int(&c->rng, 2);
    nz_frame f = cv_frame(c, often, 1, turns);
    float e = f.step + 0.004f;
    if (kind < 2) { /* stripes, perhaps only in one band across */
        float low = kind ? -9 : cv_range(c, -0.5f, 0.2f), high = kind ? 9 : low + cv_range(c, 0.1f, 0.3f);
        for (int i = 0; i < c->count; i++) {
            float t = nz_abs(f.u[i] - nz_floor(f.u[i]) - 0.5f);
            mask[i] = nz_smooth(0.5f * wide + e, 0.5f * wide - e, t) * (c->y[i] > low && c->y[i] < high);
        }
    } else if (kind == 2) { /* one area against the rest */
        float edge = cv_range(c, -0.3f, 0.3f) * often + 0.5f * (f.u[0] + f.u[c->count - 1]);
        for (int i = 0; i < c->count; i++) mask[i] = nz_smooth(edge - e, edge + e, f.u[i]);
    } else { /* rings and bars like printed signs */
        nz_cells cells = cv_cells(c);
        nz_cell(f, 1, 0.6f, 0, cv_seed(c), cells);
        float radius = cv_range(c, 0.15f, 0.35f), thick = cv_range(c, 0.04f, 0.12f);
        for (int i = 0; i < c->count; i++) {
            float id = cells.id[i], x = nz_abs(cells.x[i]), y = nz_abs(cells.y[i]);
            float ring = nz_abs(cells.near[i] - radius) - thick, bar = nz_max(x - radius, y - thick),
                  triangle = nz_max(x * 1.7f + cells.y[i], -cells.y[i]) - 0.7f * radius;
            float d = id < 0.3f ? ring : id < 0.6f ? bar : id < 0.8f ? triangle : 1;
            mask[i] = nz_smooth(e, -e, d);
        }
    }
    cv_drop(c, mark);
}

static void base(io_canvas *c, io_substance *under, nz_frame f)
{
    int kind = ts_rng_int(&c->rng, 5);
    io_rgb colour;
    if (kind < 3) *under = pal_metal(c, cv_range(c, 0.2f, 0.6f));
    else {
        static const uint32_t bare[] = {0xa08058, 0x7d6148, 0x9b968c, 0xc7bda8, 0x6a5d50, 0x8b5a40};
        pal_pick(c, bare, PAL_COUNT(bare), 0.5f, colour);
        *under = pal_dielectric(c, colour, cv_range(c, 0.6f, 0.95f));
    }
    cv_fill(c, under);
    int mark = c->used;
    float turns = cv_range(c, 0, 1), scale = cv_range(c, 8, 25);
    nz_frame grain = cv_frame(c, scale, kind == 3 ? 12 : 1, turns);
    float *fine = cv_noise(c, grain, NZ_SMOOTH, 1, 4, 0.65f), *tone = cv_noise(c, f, NZ_SMOOTH, 1.5f, 5, 0.6f);
    cv_shade(c, fine, cv_range(c, 0.05f, 0.2f));
    cv_shade(c, tone, cv_range(c, 0.05f, 0.25f));
    cv_roughen(c, tone, 0.06f);
    cv_raise(c, fine, cv_log_range(c, 0.0002f, 0.002f));
    cv_drop(c, mark);
}

void io_family_paint(io_canvas *c)
{
    float turns = cv_range(c, 0, 1), stretch = cv_chance(c, 0.3f) ? cv_range(c, 1.5f, 4) : 1,
          scale = cv_log_range(c, 1, 4);
    nz_frame plain = cv_frame(c, scale, stretch, turns), f = cv_bend(c, plain, 1.5f, 4, 0.025f);
    io_substance under;
    base(c, &under, f);
    float wear_gain = cv_range(c, 0.5f, 0.75f), wear_frequency = cv_range(c, 0.6f, 1.5f);
    float *wear = cv_noise(c, f, NZ_SMOOTH, wear_frequency, 7, wear_gain), *edge = cv_plane(c), *coat = cv_plane(c),
          *mark = cv_plane(c);
    if (cv_chance(c, 0.4f)) { /* boards or sheets: paint goes first at their borders */
        float sheet_turns = 0.25f * (float)ts_rng_int(&c->rng, 2), sheets = cv_log_range(c, 1.2f, 6);
        nz_frame sheet = cv_frame(c, sheets, 1, sheet_turns);
        nz_cells cells = cv_cells(c);
        uint32_t seed = cv_seed(c);
        nz_brick(sheet, (nz_brick_shape){cv_chance(c, 0.5f) ? 1000 : cv_range(c, 1, 3), 0.5f, 0, 0.05f}, seed, cells);
        float gap = cv_range(c, 0.005f, 0.03f), strong = cv_range(c, 0.5f, 2.5f), depth = cv_range(c, 0.005f, 0.03f);
        for (int i = 0; i < c->count; i++) {
            edge[i] = strong * nz_smooth(0.15f, 0, cells.edge[i]);
            c->height[i] -= depth * nz_smooth(gap + 0.02f + sheet.step, gap, cells.edge[i]);
        }
        cv_drop(c, c->used - 7);
    } else
        for (int i = 0; i < c->count; i++) edge[i] = 0;

    int coats = 1 + ts_rng_int(&c->rng, 3);
    float bare = cv_chance(c, 0.3f) ? cv_range(c, 0.001f, 0.05f) : cv_range(c, 0.05f, 0.6f),
          crisp = cv_log_range(c, 0.02f, 0.12f), thick = cv_log_range(c, 0.0006f, 0.004f);
    const float level = cv_level(bare);
    for (int k = 0; k < coats; k++) {
        io_rgb colour;
        pal_paint(c, colour);
        io_substance paint = pal_dielectric(c, colour,
                                            cv_chance(c, 0.5f) ? cv_range(c, 0.1f, 0.4f) : cv_range(c, 0.35f, 0.85f));
        if (cv_chance(c, 0.08f)) paint = pal_metal(c, cv_range(c, 0.3f, 0.5f)); /* bronze or aluminium paint */
        for (int i = 0; i < c->count; i++) coat[i] = -wear[i] - edge[i];
        cv_threshold(c, coat, -level + 0.25f * (float)k, crisp);
        cv_cover(c, coat, 1, &paint);
        cv_raise(c, coat, thick);
        if (k + 1 == coats && cv_chance(c, 0.35f)) {
            io_substance second = paint;
            pal_paint(c, second.diffuse);
            stencil(c, mark);
            for (int i = 0; i < c->count; i++) mark[i] *= coat[i];
            cv_cover(c, mark, cv_range(c, 0.7f, 1), &second);
        }
    }
    /* The last coat: brush marks or orange skin, faded in patches. */
    float brush_turns = cv_range(c, 0, 1), brush_stretch = cv_chance(c, 0.5f) ? cv_range(c, 8, 30) : 1,
          brush_scale = cv_log_range(c, 10, 40);
    nz_frame brush = cv_frame(c, brush_scale, brush_stretch, brush_turns);
    brush.step = nz_min(brush.step, 0.5f);
    float *stroke = cv_noise(c, brush, NZ_SMOOTH, 0.5f, 3, 0.5f);
    for (int i = 0; i < c->count; i++) stroke[i] *= coat[i];
    cv_raise(c, stroke, cv_log_range(c, 0.00005f, 0.0012f));
    cv_shade(c, stroke, cv_range(c, 0, 0.06f));
    nz_fbm(f, NZ_SMOOTH, 0.7f, 6, 0.6f, cv_seed(c), mark);
    for (int i = 0; i < c->count; i++) mark[i] *= coat[i];
    cv_shade(c, mark, cv_range(c, 0, 0.15f));
    cv_roughen(c, mark, cv_range(c, 0, 0.1f));
    c->used = 0;
    if (cv_chance(c, 0.5f)) {
        float longest = cv_log_range(c, 0.1f, 0.9f);
        wear_scratches(c, 4 + ts_rng_int(&c->rng, 50), longest, &under);
    }
    if (cv_chance(c, 0.3f)) wear_decals(c);
    wear_any(c, 0.6f);
}
