/* Faces that lean, each another way: leather and slate tiles, glass mosaic, wooden blocks, padded panels. Where colour
 * and gloss are the same on all of them, their brightness alone says how they stand. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t bodies[] = {0x3b4048, 0x2b2420, 0x4a3328, 0x6b4a33, 0x8c6a4c, 0x54585e, 0x7d7a74, 0xa8a298,
                                  0xd8d2c4, 0x2f4a58, 0x5f7a80, 0x3c4a2a, 0x7a2f28, 0x1c1c1e, 0xc9b994, 0x94806a};

typedef struct faces {
    float joint, bevel, depth, lean, dome, bowl;
    bool round;         /* pillows in place of bevels */
    float lap[2];       /* rise of a face along x and y, which ends in a step down to the next one, with its sign */
    float width, riser; /* of a face in x; of the step */
} faces;

/* Shingles, slates, boards: each lies over the next one, so that there is a step at one side of a joint only. */
static float lapped(const faces *w, float x, float y)
{
    const float along[2] = {x / w->width, y}, size[2] = {w->width, 1};
    float height = 0;
    for (int k = 0; k < 2; k++) {
        const float up = (w->lap[k] < 0 ? -along[k] : along[k]) + 0.5f;
        height += nz_abs(w->lap[k]) * (up - nz_smooth(1 - w->riser / size[k], 1, up));
    }
    return height;
}

/* Lengths are in rows; solid receives 1 on faces and 0 in joints. */
static void build(io_canvas *c, nz_frame f, nz_cells cells, const faces *w, float unit, float *solid)
{
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], x = cells.x[i], y = cells.y[i], e = cells.edge[i],
                    t = nz_clamp((e - w->joint) / w->bevel, 0, 1), side = w->round ? t * (2 - t) : nz_smooth(0, 1, t);
        const float turn = nz_again(id, 1), lean = w->lean * (0.3f + 0.7f * nz_again(id, 2)),
                    slope = lean * (nz_sine(turn) * x + nz_sine(turn + 0.25f) * y),
                    dome = (nz_again(id, 3) < w->bowl ? w->dome : -w->dome) * (x * x + y * y);
        solid[i] = nz_smooth(w->joint - 0.6f * f.step, w->joint + 0.6f * f.step + 0.01f, e);
        c->height[i] = unit * (side * (w->depth + slope + dome) + lapped(w, x, y));
    }
}

/* Steep risers, along one direction of the faces or both. */
static void lap(io_canvas *c, faces *w, float step)
{
    const int which = ts_rng_int(&c->rng, 3); /* 0: x, 1: y, 2: both */
    w->riser = cv_range(c, 0.03f, 0.16f) + step;
    for (int k = 0; k < 2; k++) {
        const float steep = cv_log_range(c, 0.6f, 2.5f), rise = cv_chance(c, 0.5f) ? steep : -steep;
        if (which == 2 || which == k) w->lap[k] = rise * w->riser;
    }
    if (cv_chance(c, 0.7f)) w->depth = 0; /* else a groove too */
}

/* A tone, a tint and a gloss for each face, at times none of them. */
static void colour(io_canvas *c, nz_cells cells, const io_rgb second)
{
    const float tones = cv_chance(c, 0.5f) ? cv_range(c, 0, 0.7f) : 0, tint = cv_chance(c, 0.4f) ? 1 : 0,
                rough = cv_chance(c, 0.5f) ? cv_range(c, 0, 0.3f) : 0;
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], t = tint * nz_again(id, 4), tone = 1 + tones * (nz_again(id, 5) - 0.5f);
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = tone * nz_mix(c->diffuse[k][i], second[k], t);
        c->roughness[i] = nz_clamp(c->roughness[i] + rough * (nz_again(id, 6) - 0.5f), 0.04f, 1);
    }
}

/* Another substance in the joints, or the same, darker. */
static void fill(io_canvas *c, float *solid)
{
    for (int i = 0; i < c->count; i++) solid[i] = 1 - solid[i];
    if (cv_chance(c, 0.5f)) {
        const io_substance joint = fin_dielectric(c, bodies, PAL_COUNT(bodies), 0.5f, 1);
        cv_cover(c, solid, 1, &joint);
    } else cv_shade(c, solid, -cv_range(c, 0, 0.8f));
}

/* Studs of metal where faces meet, or in their middle. */
static void studs(io_canvas *c, nz_cells cells, float unit)
{
    const float size = cv_range(c, 0.05f, 0.14f), high = cv_range(c, 0.03f, 0.12f),
                stretch = cv_log_range(c, 0.6f, 1.6f);
    const bool middle = cv_chance(c, 0.4f);
    const io_substance metal = fin_metal(c, cv_range(c, 0.12f, 0.45f));
    float *stud = cv_plane(c);
    for (int i = 0; i < c->count; i++) {
        float x = cells.x[i], y = cells.y[i];
        if (!middle) { /* x and y are from the middle of the face: the corners are half a row off */
            x = nz_abs(x) - 0.5f;
            y = nz_abs(y) - 0.5f;
        }
        const float s = nz_max(0, 1 - (x * x * stretch + y * y / stretch) / (size * size));
        stud[i] = nz_smooth(0, 0.15f, s);
        c->height[i] += unit * high * s * (2 - s);
    }
    cv_cover(c, stud, 1, &metal);
}

void io_family_faces(io_canvas *c)
{
    const float smooth = cv_log_range(c, 0.12f, 0.7f);
    const bool metal = cv_chance(c, 0.1f);
    io_substance body = metal ? fin_metal(c, smooth) : fin_dielectric(c, bodies, PAL_COUNT(bodies), 0.15f, 0.8f);
    if (!metal && cv_chance(c, 0.5f)) body.roughness = smooth;
    io_rgb second;
    pal_vary(c, body.diffuse, 0.8f, second);
    cv_fill(c, &body);
    const float rows = cv_log_range(c, 1.3f, 10), turns = cv_range(c, 0, 1), often = cv_range(c, 0.3f, 1),
                bend = cv_chance(c, 0.6f) ? 0.002f : cv_range(c, 0.01f, 0.08f);
    const int pattern = ts_rng_int(&c->rng, 6); /* 0 to 2: squares; 3: a bond; 4: hexagons; 5: of any shape */
    const nz_frame straight = cv_frame(c, rows, pattern == 4 ? 0.8660254f : 1, turns),
                   f = cv_bend(c, straight, often, 2, bend);
    nz_cells cells = cv_cells(c);
    faces w = {.width = 1, .riser = 1};
    if (pattern < 4) {
        nz_brick_shape shape = {.width = 1, .shift = pattern == 3 ? 0.5f : 0};
        if (pattern > 1) shape.width = cv_range(c, 1, 3);
        shape.round = cv_range(c, 0.01f, 0.2f);
        w.width = shape.width;
        nz_brick(f, shape, cv_seed(c), cells);
    } else nz_cell(f, 1, pattern == 4 ? 0 : 0.9f, 0.5f, cv_seed(c), cells);
    w.joint = cv_chance(c, 0.3f) ? 0 : cv_range(c, 0.005f, 0.05f);
    w.round = cv_chance(c, 0.4f);
    w.bevel = (w.round ? cv_range(c, 0.1f, 0.45f) : cv_range(c, 0.015f, 0.12f)) + 0.7f * f.step;
    w.depth = cv_range(c, 0.01f, 0.1f);
    w.lean = cv_log_range(c, 0.04f, 0.4f);
    w.dome = cv_chance(c, 0.4f) ? cv_range(c, 0, 0.3f) : 0;
    w.bowl = cv_chance(c, 0.3f) ? cv_range(c, 0, 1) : 0;
    if (pattern < 4 && cv_chance(c, 0.45f)) lap(c, &w, f.step);
    float *solid = cv_plane(c);
    build(c, f, cells, &w, 1 / rows, solid);
    colour(c, cells, second);
    fill(c, solid);
    if (pattern < 2 && cv_chance(c, 0.35f)) studs(c, cells, 1 / rows);
    c->used = 0;
    const float mottle = cv_chance(c, 0.5f) ? cv_range(c, 0, 0.2f) : 0, clouds = cv_log_range(c, 1, 10);
    const nz_frame plain = cv_frame(c, 1, 1, 0);
    cv_shade(c, cv_noise(c, plain, NZ_SMOOTH, clouds, 4, 0.6f), mottle);
    c->used = 0;
    if (cv_chance(c, 0.5f)) fin_grain(c, 0.12f);
    if (cv_chance(c, 0.4f)) fin_crevices(c);
    if (!metal) fin_level(c, 0.15f);
    if (cv_chance(c, 0.2f)) fin_gloss(c);
    if (cv_chance(c, 0.1f)) fin_coat(c);
}
