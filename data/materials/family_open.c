/* What has openings: sheets with holes and slots (punched metal, pierced leather and board, worm-eaten wood,
 * cheese-like stone), and lattices of strands over a gap (cane, wicker, wire mesh, netting). Behind them lies something
 * else, mostly the dark. */
#include "data/materials/family.h"
#include "data/materials/finish.h"
#include <math.h>

static const uint32_t bodies[] = {0xd8d2c4, 0xb59a72, 0x8c6a4c, 0x5c4636, 0x3a2d24, 0x1c1c1e, 0xe8e4da, 0x7d7a74,
                                  0x54585e, 0x2f4a58, 0x7a2f28, 0x3c4a2a, 0xc9b994, 0xa8946c, 0x9aa0a4, 0xf0eee8};

/* Behind the openings: hardly any light comes back, or another substance. */
static io_substance behind(io_canvas *c)
{
    if (cv_chance(c, 0.4f)) return fin_dielectric(c, bodies, PAL_COUNT(bodies), 0.5f, 1);
    const float grey = cv_log_range(c, 0.003f, 0.05f), warm = cv_range(c, 0.7f, 1.2f), rough = cv_range(c, 0.5f, 1);
    return (io_substance){{grey, grey * 0.5f * (1 + warm), grey * warm}, {0.04f, 0.04f, 0.04f}, rough};
}

typedef struct holes {
    float radius, along, corner; /* half width, and half of the straight part of slots; a square's rounding, 0: round */
    float wall, depth;           /* how broad the wall looks, how deep the opening is */
    float rim, broad;            /* a raised or sunk rim, and its width */
    float spread, missing;       /* how much sizes differ; the share of cells without a hole */
} holes;

/* How far a pixel lies inside of the hole of its cell, negative outside; a hole's size is its own. */
static inline float inside(const holes *w, float x, float y, float id)
{
    const float r = w->radius * (1 + w->spread * (2 * nz_again(id, 1) - 1)), p = nz_max(nz_abs(x) - w->along, 0),
                q = nz_abs(y);
    if (w->corner <= 0) return r - sqrtf(p * p + q * q);
    const float k = w->corner * r, a = nz_max(p - r + k, 0), b = nz_max(q - r + k, 0);
    return k - sqrtf(a * a + b * b) - nz_min(nz_max(p - r + k, q - r + k), 0);
}

/* Lengths are in cells; open receives 1 in the openings. */
static void pierce(io_canvas *c, nz_frame f, nz_cells cells, const holes *w, float *open)
{
    for (int i = 0; i < c->count; i++) {
        open[i] = 0;
        if (nz_again(cells.id[i], 2) < w->missing) continue;
        const float e = inside(w, cells.x[i], cells.y[i], cells.id[i]), past = -e / w->broad;
        open[i] = nz_smooth(-0.6f * f.step - 0.01f, 0.6f * f.step, e - 0.5f * w->wall);
        c->height[i] += w->rim * nz_bump(past - 0.3f) - w->depth * nz_smooth(0, w->wall + f.step, e);
    }
}

void io_family_pierced(io_canvas *c)
{
    const bool metal = cv_chance(c, 0.4f);
    const float polish = cv_log_range(c, 0.15f, 0.65f);
    const io_substance sheet = metal ? fin_metal(c, polish) : fin_dielectric(c, bodies, PAL_COUNT(bodies), 0.25f, 0.9f);
    cv_fill(c, &sheet);
    const io_substance back = behind(c);
    const int pattern = ts_rng_int(&c->rng, 6); /* 0, 1: round; 2: slots; 3: squares; 4, 5: anywhere, of any size */
    const float rows = cv_log_range(c, 2, 18), turns = cv_chance(c, 0.6f) ? 0 : cv_range(c, 0, 1),
                often = cv_range(c, 0.5f, 2), bend = pattern > 3 ? cv_range(c, 0.05f, 0.3f) : cv_range(c, 0, 0.01f);
    const bool staggered = cv_chance(c, 0.6f);
    const nz_frame straight = cv_frame(c, rows, staggered ? 0.8660254f : 1, turns),
                   f = cv_bend(c, straight, often, 3, bend);
    const float jitter = pattern > 3 ? cv_range(c, 0.4f, 0.9f) : 0;
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, jitter, staggered ? 0.5f : 0, cv_seed(c), cells);
    holes w = {.radius = pattern == 2 ? cv_range(c, 0.08f, 0.2f) : cv_range(c, 0.14f, 0.4f)};
    if (pattern == 2) w.along = cv_range(c, 0.05f, 0.42f - w.radius);
    if (pattern == 3) w.corner = cv_range(c, 0.1f, 0.8f);
    w.wall = nz_min(cv_log_range(c, 0.03f, 0.2f), 0.8f * w.radius);
    w.depth = cv_log_range(c, 0.05f, 0.5f);
    w.broad = cv_log_range(c, 0.05f, 0.25f);
    w.rim = cv_chance(c, 0.4f) ? cv_range(c, -0.06f, 0.06f) : 0;
    w.spread = pattern > 3 ? cv_range(c, 0.1f, 0.8f) : 0;
    w.missing = pattern > 3 ? cv_range(c, 0, 0.6f) : cv_chance(c, 0.2f) ? cv_range(c, 0, 0.3f) : 0;
    float *open = cv_plane(c);
    pierce(c, f, cells, &w, open);
    cv_cover(c, open, 1, &back);
    fin_relief(c, 0.08f, 0.4f);
    fin_any(c, 0.12f, 0.05f);
}

typedef struct strands {
    float width, sway;      /* half of a strand and how far it is off its place, of half the spacing */
    float flat, ride, over; /* thickness of half the width; rise at crossings; height above those that lie below */
    float share;            /* of the places that have a strand */
    float tones, gloss;     /* by how much strands differ */
    float phase;
    uint32_t seed;
} strands;

/* Parallel strands, one a unit of u, over what lies there; solid receives 1 and tone a strand's own shade. */
static void lay(io_canvas *c, nz_frame f, const strands *w, float unit, float *solid, float *tone)
{
    const float thick = 0.5f * w->width * unit;
    for (int i = 0; i < c->count; i++) {
        const float base = nz_floor(f.u[i]);
        const int n = (int)base;
        const uint32_t hash = nz_hash(n, 3, w->seed);
        const float id = nz_unit(hash), x = (2 * (f.u[i] - base) - 1 - w->sway * (2 * nz_again(id, 1) - 1)) / w->width;
        if (x * x >= 1 || nz_again(id, 2) >= w->share) continue;
        const float ride = w->ride * nz_sine(0.5f * (f.v[i] + (float)(n & 1)) + w->phase),
                    h = thick * (w->over + ride + w->flat * sqrtf(1 - x * x));
        if (h <= c->height[i]) continue;
        c->height[i] = h;
        solid[i] = 1;
        tone[i] = w->tones * (nz_again(id, 4) - 0.5f);
        c->roughness[i] = nz_clamp(c->roughness[i] + w->gloss * (nz_again(id, 5) - 0.5f), 0.04f, 1);
    }
}

void io_family_lattice(io_canvas *c)
{
    static const float turned[][4] = {{0, 0.25f}, {0, 0.25f}, {0, 0.166667f, 0.333333f}, {0, 0.25f, 0.125f, 0.375f}};
    static const int many[] = {2, 2, 3, 4};
    const bool metal = cv_chance(c, 0.3f);
    const float polish = cv_log_range(c, 0.15f, 0.6f);
    const io_substance strand = metal ? fin_metal(c, polish)
                                      : fin_dielectric(c, bodies, PAL_COUNT(bodies), 0.3f, 0.95f);
    const io_substance back = behind(c);
    cv_fill(c, &strand);
    float *solid = cv_plane(c), *tone = cv_plane(c);
    const float rows = cv_log_range(c, 2.5f, 16), gap = cv_log_range(c, 0.1f, 1.5f), loose = cv_range(c, 0, 0.5f);
    const int way = ts_rng_int(&c->rng, PAL_COUNT(turned));
    const float turns = cv_chance(c, 0.5f) ? cv_range(c, -0.02f, 0.02f) : cv_range(c, 0, 1);
    strands w = {.width = cv_range(c, 0.15f, 0.7f)};
    w.flat = cv_range(c, 0.4f, 1);
    const bool layers = cv_chance(c, 0.35f); /* each set lies over the one before */
    const float ride = layers ? 0 : cv_range(c, 0.3f, 1);
    w.tones = cv_range(c, 0, 0.7f);
    w.gloss = cv_chance(c, 0.4f) ? cv_range(c, 0, 0.3f) : 0;
    for (int i = 0; i < c->count; i++) c->height[i] = -0.5f * gap * w.width / rows, solid[i] = tone[i] = 0;
    for (int k = 0; k < many[way]; k++) {
        const int mark = c->used;
        const float bend = loose * cv_range(c, 0, 0.5f), angle = turns + turned[way][k];
        const bool odd = k > 1 && cv_chance(c, 0.5f); /* a third way, seldom or thinner */
        strands s = w;
        s.ride = ride;
        s.sway = loose * (1 - w.width);
        s.over = layers ? 1.2f * (float)k : 0;
        s.share = odd ? cv_range(c, 0.3f, 1) : 1;
        s.width *= odd ? cv_range(c, 0.5f, 1) : 1;
        s.phase = k == 1 ? 0.5f : 0;
        s.seed = cv_seed(c);
        const nz_frame straight = cv_frame(c, rows, 1, angle);
        lay(c, cv_bend(c, straight, 0.5f, 2, bend), &s, 1 / rows, solid, tone);
        cv_drop(c, mark);
    }
    cv_shade(c, tone, 1);
    float *fibre = cv_plane(c);
    for (int i = 0; i < c->count; i++) fibre[i] = 1 - solid[i];
    cv_cover(c, fibre, 1, &back);
    fin_relief(c, 0.12f, 0.45f);
    fin_any(c, 0.1f, 0.04f);
}
