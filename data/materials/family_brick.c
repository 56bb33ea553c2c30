/* Walls of bricks, with mortar. */
#include "data/materials/family.h"

static const uint32_t clay[] = {0x8c4a36, 0x9d5a42, 0x73392b, 0xa86a4c, 0x5e3028, 0xb57d5c, 0x7d4f3d,
                                0x4b2b25, 0xc29a78, 0x94806a, 0x6a5147, 0x5a5450, 0xd0c2aa, 0x3b3533};
static const uint32_t lime[] = {0xb8b0a2, 0x9a948a, 0x7d7870, 0xcfc8ba, 0x5c5853, 0x8f8672, 0x3f3d3b};

void io_family_brick(io_canvas *c)
{
    io_rgb a, b, d;
    pal_pick(c, clay, PAL_COUNT(clay), 0.5f, a);
    pal_vary(c, a, 0.8f, b);
    pal_pick(c, lime, PAL_COUNT(lime), 0.5f, d);
    io_substance brick = pal_dielectric(c, a, cv_range(c, 0.5f, 0.95f)),
                 mortar = pal_dielectric(c, d, cv_range(c, 0.75f, 1));
    cv_fill(c, &brick);

    float rows = cv_log_range(c, 3, 12), turns = cv_chance(c, 0.6f) ? cv_range(c, -0.01f, 0.01f) : cv_range(c, 0, 1);
    nz_frame straight = cv_frame(c, rows, 1, turns);
    float bend = cv_log_range(c, 0.008f, 0.06f), bend_frequency = cv_range(c, 0.6f, 1.5f);
    nz_frame f = cv_bend(c, straight, bend_frequency, 3, bend);
    nz_brick_shape shape;
    shape.width = cv_range(c, 1.8f, 3.4f);
    shape.shift = cv_chance(c, 0.75f) ? 0.5f : cv_range(c, 0, 0.4f);
    shape.loose = cv_chance(c, 0.2f) ? 1 : 0.04f;
    shape.round = cv_range(c, 0.02f, 0.2f);
    nz_cells cells = cv_cells(c);
    bool herringbone = cv_chance(c, 0.1f);
    uint32_t seed = cv_seed(c);
    if (herringbone) nz_herringbone(f, 2 + ts_rng_int(&c->rng, 2), shape.round, seed, cells);
    else nz_brick(f, shape, seed, cells);

    float unit = 1 / rows, joint = cv_range(c, 0.05f, 0.14f), bevel = cv_range(c, 0.03f, 0.14f) + 0.5f * straight.step,
          depth = cv_range(c, 0.03f, 0.2f);
    if (cv_chance(c, 0.15f)) depth *= -0.3f; /* mortar that bulges out */
    float grain_gain = cv_range(c, 0.5f, 0.65f), grain_frequency = cv_range(c, 1.5f, 4);
    float *grain = cv_noise(c, f, NZ_SMOOTH, grain_frequency, 5, grain_gain);
    float *mask = cv_plane(c), ragged = cv_range(c, 0.005f, 0.03f);
    for (int i = 0; i < c->count; i++) mask[i] = cells.edge[i] + ragged * grain[i];
    float *body = cv_plane(c);
    for (int i = 0; i < c->count; i++) body[i] = nz_smooth(joint, joint + bevel, mask[i]);
    cv_raise(c, body, depth * unit);
    float uneven = cv_range(c, 0, 0.05f) * unit, tilt = cv_range(c, 0, 0.06f) * unit;
    for (int i = 0; i < c->count; i++)
        c->height[i] += body[i] *
            (uneven * cells.id[i] +
             tilt * ((nz_again(cells.id[i], 1) - 0.5f) * cells.x[i] + (nz_again(cells.id[i], 2) - 0.5f) * cells.y[i]));
    cv_raise(c, grain, cv_log_range(c, 0.003f, 0.03f) * unit);

    float spread = cv_range(c, 0.1f, 0.7f), to_second = cv_range(c, 0, 1), rough = cv_range(c, 0, 0.2f);
    for (int i = 0; i < c->count; i++) {
        float id = cells.id[i], t = to_second * nz_smooth(0.3f, 1, nz_again(id, 3) + 0.15f * grain[i]),
              tone = 1 + spread * (nz_again(id, 4) - 0.5f);
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = nz_mix(c->diffuse[k][i], b[k], t) * tone;
        c->roughness[i] += rough * (nz_again(id, 5) - 0.5f);
    }
    cv_shade(c, grain, cv_range(c, 0.05f, 0.2f));
    if (cv_chance(c, 0.3f)) { /* soot or glaze burnt on single bricks */
        float share = cv_range(c, 0.05f, 0.3f), darker = cv_range(c, 0.3f, 0.7f), smoother = cv_range(c, 0, 0.4f);
        for (int i = 0; i < c->count; i++)
            if (nz_again(cells.id[i], 6) < share) {
                for (int k = 0; k < 3; k++) c->diffuse[k][i] *= darker;
                c->roughness[i] -= smoother;
            }
    }
    float *pits = cv_noise(c, f, NZ_SMOOTH, cv_range(c, 4, 9), 2, 0.5f);
    cv_threshold(c, pits, cv_level(cv_range(c, 0.01f, 0.15f)), 0.4f);
    cv_raise(c, pits, -0.02f * unit);
    cv_shade(c, pits, -0.4f);
    cv_threshold(c, mask, joint + 0.35f * bevel, 0.25f * bevel + 0.5f * straight.step);
    for (int i = 0; i < c->count; i++) mask[i] = 1 - mask[i];
    cv_cover(c, mask, 1, &mortar);
    float *sand = cv_noise(c, straight, NZ_SMOOTH, cv_range(c, 6, 14), 3, 0.7f);
    for (int i = 0; i < c->count; i++) sand[i] *= mask[i];
    cv_shade(c, sand, 0.15f);
    cv_raise(c, sand, 0.006f * unit);
    if (cv_chance(c, 0.2f)) { /* a coat of paint over everything, worn in places */
        io_rgb p;
        pal_paint(c, p);
        io_substance paint = pal_dielectric(c, p, cv_range(c, 0.3f, 0.8f));
        seed = cv_seed(c);
        nz_fbm(f, NZ_SMOOTH, cv_range(c, 0.2f, 1), 5, 0.6f, seed, pits);
        cv_threshold(c, pits, cv_level(cv_range(c, 0.6f, 1)), 0.12f);
        cv_cover(c, pits, 1, &paint);
    }
    float dirt = cv_range(c, 0, 0.6f), dirt_radius = cv_range(c, 0.1f, 0.3f) * unit;
    wear_dirt(c, dirt_radius, dirt);
    wear_any(c, 0.7f);
}
