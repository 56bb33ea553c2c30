/* Walls and paving whose stones are uneven: joints lie deep, every stone has its own tint, lean and chipped edges. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t clay[] = {0x8c4a36, 0x9d5a42, 0x73392b, 0xa86a4c, 0x5e3028,
                                0xb57d5c, 0xc29a78, 0x94806a, 0x5a5450};
static const uint32_t stone[] = {0x7b766e, 0x5d5a55, 0x96897a, 0x4a4947, 0x6b5f52,
                                 0xa89c88, 0x3a3a3b, 0x84705c, 0x58606a};
static const uint32_t filling[] = {0xb8b0a2, 0x9a948a, 0x7d7870, 0xcfc8ba, 0x5c5853, 0x6b604f, 0x4b4236, 0x3b3a2c};

/* What a wall of either kind is made of; lengths in rows. */
typedef struct wall {
    float joint, bevel, dome, lean, uneven, chips, ragged;
} wall;

/* Heights of the stones over the joints in the canvas's height; solid receives 1 on stones and 0 in joints. */
static void build(io_canvas *c, nz_frame f, nz_cells cells, const wall *w, float unit, float *solid)
{
    const int mark = c->used;
    const float soft = 0.6f * f.step;
    float *rag = cv_noise(c, f, NZ_SMOOTH, 3, 4, 0.6f), *lump = cv_noise(c, f, NZ_SMOOTH, 1, 4, 0.55f);
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], chip = w->chips * nz_max(0, lump[i] + 0.5f * rag[i] - 1 + nz_again(id, 3));
        const float e = cells.edge[i] + w->ragged * rag[i] - chip, t = nz_clamp((e - w->joint) / w->bevel, 0, 1);
        solid[i] = nz_smooth(w->joint - soft, w->joint + soft + 0.02f, e);
        const float lean = (nz_again(id, 1) - 0.5f) * cells.x[i] + (nz_again(id, 2) - 0.5f) * cells.y[i];
        const float top = 1 + w->uneven * (id - 0.5f) + w->lean * lean + w->dome * nz_min(0.5f, e);
        c->height[i] = unit * solid[i] * (0.25f * t * (2 - t) * top + 0.012f * lump[i] + 0.004f * rag[i]);
    }
    cv_drop(c, mark);
}

/* A tint for every stone, between two colours, and a tone of its own. */
static void colour(io_canvas *c, nz_cells cells, const io_rgb second, float tones)
{
    const float to_second = cv_range(c, 0, 1), rough = cv_range(c, 0, 0.3f);
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], t = to_second * nz_again(id, 4), tone = 1 + tones * (nz_again(id, 5) - 0.5f);
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = tone * nz_mix(c->diffuse[k][i], second[k], t);
        c->roughness[i] += rough * (nz_again(id, 6) - 0.5f);
    }
}

/* Sand or mortar in the joints, flush or recessed, with a grain of its own; then paint over everything at times. */
static void fill(io_canvas *c, nz_frame f, float *solid, float unit)
{
    const int mark = c->used;
    const io_substance mortar = fin_dielectric(c, filling, PAL_COUNT(filling), 0.7f, 1);
    const float often = cv_range(c, 4, 12), strong = cv_range(c, 0.05f, 0.25f), rise = cv_range(c, 0, 0.12f) * unit;
    float *sand = cv_noise(c, f, NZ_SMOOTH, often, 3, 0.7f);
    for (int i = 0; i < c->count; i++) {
        const float open = 1 - solid[i];
        c->height[i] += open * (rise + 0.015f * unit * sand[i]);
        sand[i] *= open;
        solid[i] = open;
    }
    cv_cover(c, solid, 1, &mortar);
    cv_shade(c, sand, strong);
    cv_drop(c, mark);
}

static void coat_of_paint(io_canvas *c)
{
    const int mark = c->used;
    io_rgb tint;
    pal_paint(c, tint);
    const io_substance paint = pal_dielectric(c, tint, cv_range(c, 0.2f, 0.9f));
    const float cycles = cv_log_range(c, 0.8f, 4), share = cv_range(c, 0.6f, 1.3f);
    nz_frame f = cv_frame(c, 1, 1, 0);
    float *left = cv_noise(c, f, NZ_SMOOTH, cycles, 5, 0.6f);
    cv_threshold(c, left, cv_level(nz_min(1, share)) - (share > 1 ? 2 : 0), 0.12f);
    cv_cover(c, left, 1, &paint);
    cv_drop(c, mark);
}

static void wall_of(io_canvas *c, nz_frame straight, nz_frame f, nz_cells cells, const wall *w, float unit,
                    const io_rgb second)
{
    float *solid = cv_plane(c);
    build(c, f, cells, w, unit, solid);
    const float tones = cv_range(c, 0, 0.9f), often = cv_range(c, 1.5f, 5), mottle = cv_range(c, 0, 0.25f),
                pits = cv_chance(c, 0.4f) ? cv_range(c, 0.01f, 0.12f) : 0;
    colour(c, cells, second, tones);
    float *grain = cv_noise(c, straight, NZ_SMOOTH, often, 5, 0.65f);
    cv_shade(c, grain, mottle);
    if (pits > 0) {
        cv_threshold(c, grain, cv_level(pits), 0.3f);
        for (int i = 0; i < c->count; i++) grain[i] *= solid[i];
        cv_raise(c, grain, -0.05f * unit);
    }
    fill(c, straight, solid, unit);
    fin_relief(c, 0.09f, 0.4f);
    if (cv_chance(c, 0.22f)) coat_of_paint(c);
    fin_any(c, 0.14f, 0.08f);
}

void io_family_masonry(io_canvas *c)
{
    const io_substance brick = fin_dielectric(c, clay, PAL_COUNT(clay), 0.5f, 0.95f);
    io_rgb second;
    pal_vary(c, brick.diffuse, 0.9f, second);
    cv_fill(c, &brick);
    const float rows = cv_log_range(c, 3, 16),
                turns = cv_chance(c, 0.6f) ? cv_range(c, -0.01f, 0.01f) : cv_range(c, 0, 1);
    const nz_frame straight = cv_frame(c, rows, 1, turns);
    const float bend = cv_log_range(c, 0.02f, 0.15f), often = cv_range(c, 0.5f, 1.5f);
    const nz_frame f = cv_bend(c, straight, often, 3, bend);
    nz_brick_shape shape = {.shift = 0.5f};
    shape.width = cv_range(c, 1.4f, 3.4f);
    shape.loose = cv_chance(c, 0.4f) ? 1 : 0.08f;
    shape.round = cv_range(c, 0.02f, 0.3f);
    nz_cells cells = cv_cells(c);
    const int length = cv_chance(c, 0.12f) ? 2 + ts_rng_int(&c->rng, 2) : 0;
    if (length) nz_herringbone(f, length, shape.round, cv_seed(c), cells);
    else nz_brick(f, shape, cv_seed(c), cells);
    wall w;
    w.joint = cv_range(c, 0.03f, 0.12f);
    w.bevel = cv_range(c, 0.05f, 0.25f) + 0.7f * f.step;
    w.dome = cv_range(c, 0, 0.6f);
    w.lean = cv_range(c, 0, 0.5f);
    w.uneven = cv_range(c, 0, 0.8f);
    w.chips = cv_chance(c, 0.7f) ? cv_range(c, 0.02f, 0.15f) : 0;
    w.ragged = cv_range(c, 0, 0.04f);
    wall_of(c, straight, f, cells, &w, 1 / rows, second);
}

void io_family_cobbles(io_canvas *c)
{
    const io_substance body = fin_dielectric(c, stone, PAL_COUNT(stone), 0.35f, 0.95f);
    io_rgb second;
    pal_vary(c, body.diffuse, 1, second);
    cv_fill(c, &body);
    const float rows = cv_log_range(c, 3, 15), turns = cv_range(c, 0, 1), stretch = cv_range(c, 0.8f, 1.6f);
    const bool setts = cv_chance(c, 0.35f);
    const nz_frame straight = cv_frame(c, rows, setts ? 1 : stretch, turns);
    const float bend = cv_range(c, 0.02f, 0.12f), often = cv_range(c, 0.4f, 1);
    const nz_frame f = cv_bend(c, straight, often, 3, bend);
    nz_cells cells = cv_cells(c);
    if (setts) {
        nz_brick_shape shape = {.shift = 0.5f};
        shape.width = cv_range(c, 0.9f, 1.6f);
        shape.loose = cv_chance(c, 0.5f) ? 1 : 0.2f;
        shape.round = cv_range(c, 0.2f, 0.48f);
        nz_brick(f, shape, cv_seed(c), cells);
    } else {
        const float jitter = cv_range(c, 0.6f, 1);
        nz_cell(f, 1, jitter, 0.5f, cv_seed(c), cells);
    }
    wall w;
    w.joint = cv_range(c, 0.02f, 0.1f);
    w.bevel = cv_range(c, 0.15f, 0.45f);
    w.dome = cv_range(c, 0, 1.5f);
    w.lean = cv_range(c, 0, 0.6f);
    w.uneven = cv_range(c, 0, 0.8f);
    w.chips = cv_chance(c, 0.3f) ? cv_range(c, 0.02f, 0.1f) : 0;
    w.ragged = cv_range(c, 0, 0.03f);
    wall_of(c, straight, f, cells, &w, 1 / rows, second);
}
