/* Creased foil, paper and film; sheets stamped with a pattern. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

void io_family_creased(io_canvas *c)
{
    static const uint32_t sheet[] = {0xf2efe6, 0xe4e0d4, 0xd8c8a8, 0xb59a78, 0x9c8a6e,
                                     0x8c8c8a, 0x232324, 0x7d3f35, 0x2d3a4c};
    const bool foil = cv_chance(c, 0.4f);
    const float gloss = cv_log_range(c, 0.08f, 0.5f);
    const io_substance body = foil ? fin_metal(c, gloss) : fin_dielectric(c, sheet, PAL_COUNT(sheet), 0.3f, 0.95f);
    cv_fill(c, &body);
    float cycles = cv_log_range(c, 2, 12), share = 1;
    const int layers = 2 + ts_rng_int(&c->rng, 3);
    for (int k = 0; k < layers; k++) {
        const float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 2), bend = cv_range(c, 0.1f, 0.5f);
        const nz_frame f = cv_bend(c, cv_frame(c, cycles, stretch, turns), 0.8f, 2, bend);
        fin_facets(c, f, true, share / cycles, cv_seed(c));
        c->used = 0;
        cycles = nz_min(60, cycles * cv_range(c, 1.3f, 3));
        share *= cv_range(c, 0.4f, 1);
    }
    if (!foil && cv_chance(c, 0.5f)) { /* a print that the creases cross */
        io_rgb ink;
        pal_paint(c, ink);
        const float often = cv_log_range(c, 1, 12), edge = cv_range(c, -0.5f, 1), width = cv_range(c, 0.02f, 0.6f),
                    gain = cv_range(c, 0.2f, 0.6f);
        const nz_frame f = cv_frame(c, 1, 1, 0);
        float *print = cv_noise(c, f, NZ_SMOOTH, often, 4, gain);
        cv_threshold(c, print, edge, width);
        cv_tint(c, print, cv_range(c, 0.2f, 1), ink);
        c->used = 0;
    }
    fin_relief(c, 0.05f, 0.35f);
    fin_any(c, foil ? 0.04f : 0.07f, foil ? 0.05f : 0.1f);
}

/* Height 0 .. 1 of one motif around its centre, x and y in -1 .. 1. */
static float motif(int kind, float x, float y, float parameter)
{
    const float d2 = x * x + y * y;
    switch (kind) {
    case 0: return nz_smooth(1, parameter, d2);                                 /* a stud */
    case 1: return nz_max(0, 1 - 1.3f * d2);                                    /* a dome */
    case 2: return nz_max(0, 1 - nz_max(nz_abs(x), nz_abs(y)));                 /* a pyramid */
    case 3: return nz_bump(2.2f * (x - y)) * nz_smooth(1, 0.6f, nz_abs(x + y)); /* a lens, as on tread plate */
    case 4: return nz_smooth(0.25f, 0.1f, nz_abs(d2 - 0.5f)) + nz_smooth(0.15f, 0.05f, d2); /* a ring and its middle */
    case 5: return nz_smooth(0.3f, 0.1f, nz_abs(x * y) * (2 - parameter)) * nz_smooth(1, 0.7f, d2); /* a cross */
    default: {
        const float petals = (x * x - y * y) * (x * x - y * y) / (d2 * d2 + 1e-4f);
        return nz_smooth(0.9f, 0.3f, d2 * (1.6f - petals)) * (0.6f + 0.4f * d2); /* a flower */
    }
    }
}

void io_family_stamped(io_canvas *c)
{
    static const uint32_t sheet[] = {0xe4e0d4, 0xb5aa94, 0x8c8c8a, 0x4a4b4d, 0x232324,
                                     0x6b4a3a, 0x7d3f35, 0x2d3a4c, 0x3c4a3a};
    const bool metal = cv_chance(c, 0.55f);
    const float gloss = cv_range(c, 0.1f, 0.55f);
    const io_substance body = metal ? fin_metal(c, gloss) : fin_dielectric(c, sheet, PAL_COUNT(sheet), 0.15f, 0.9f);
    cv_fill(c, &body);
    const int kind = ts_rng_int(&c->rng, 7), turned = ts_rng_int(&c->rng, 3);
    const float rows = cv_log_range(c, 3, 22), stretch = cv_range(c, 0.7f, 1.5f), parameter = cv_range(c, 0.3f, 0.9f),
                size = cv_range(c, 0.55f, 1.05f), stagger = cv_chance(c, 0.5f) ? 0.5f : 0,
                sink = cv_chance(c, 0.3f) ? -1 : 1, bend = cv_chance(c, 0.4f) ? cv_range(c, 0.02f, 0.1f) : 0,
                worn = cv_range(c, 0, 0.4f),
                turns = cv_chance(c, 0.6f) ? 0.125f * (float)ts_rng_int(&c->rng, 4) : cv_range(c, 0, 1);
    const nz_frame straight = cv_frame(c, rows, stretch, turns), f = cv_bend(c, straight, 0.6f, 2, bend);
    const uint32_t seed = cv_seed(c);
    float *up = cv_plane(c), *uneven = cv_noise(c, straight, NZ_SMOOTH, 0.5f, 3, 0.5f);
    for (int i = 0; i < c->count; i++) {
        const float v = nz_floor(f.v[i]), shift = (int)v & 1 ? stagger : 0, u = nz_floor(f.u[i] - shift);
        float x = (2 * (f.u[i] - shift - u) - 1) / size, y = (2 * (f.v[i] - v) - 1) / size;
        if (turned && ((int)u + (int)v) & 1) { /* neighbours stand across */
            const float t = x;
            x = turned == 1 ? -x : y;
            y = turned == 1 ? y : t;
        }
        const float own = 1 - worn * nz_unit(nz_hash((int)u, (int)v, seed));
        up[i] = nz_abs(x) < 1.5f && nz_abs(y) < 1.5f ? own * motif(kind, x, y, parameter) : 0;
        c->height[i] = (sink * 0.2f * up[i] + 0.02f * uneven[i]) / rows;
    }
    const int over = ts_rng_int(&c->rng, 4); /* 0, 1: as it is; 2: patina or paint in the depths; 3: on the heights */
    if (over > 1) {
        io_rgb colour;
        pal_paint(c, colour);
        const io_substance layer = pal_dielectric(c, colour, cv_range(c, 0.3f, 1));
        const float edge = cv_range(c, 0.2f, 0.7f), ragged = cv_range(c, 0, 0.15f);
        for (int i = 0; i < c->count; i++) {
            const float t = nz_smooth(edge - 0.15f, edge + 0.15f, up[i] + ragged * uneven[i]);
            up[i] = over == 2 ? 1 - t : t;
        }
        cv_cover(c, up, cv_range(c, 0.4f, 1), &layer);
    }
    fin_relief(c, 0.06f, 0.35f);
    fin_any(c, 0.07f, 0.1f);
}
