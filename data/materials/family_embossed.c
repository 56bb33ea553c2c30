/* One shape repeated over the sheet: tread plate, studs, pyramids, scales, hammer marks, holes, waves; and moulded
 * plastics. */
#include "data/materials/family.h"
#include <math.h>

enum { TREAD, STUDS, PYRAMIDS, SCALES, HAMMERED, HOLES, CARVED, WAVES, SHAPES };

/* relief in [0, 1] and where the shape is, in lattice units; e: half a pixel */
static void shape_at(int shape, const nz_cells *cells, const nz_frame *f, int i, float size, float e, float *relief,
                     float *where)
{
    float x = cells->x[i], y = cells->y[i], r = cells->near[i];
    switch (shape) {
    case TREAD: {
        float odd = 0.5f * (nz_floor(f->u[i]) + nz_floor(f->v[i])), slant = odd - nz_floor(odd) > 0.25f ? 1 : -1;
        float p = 0.7071068f * (x + slant * y), q = 0.7071068f * (y - slant * x) * 3,
              d = 1 - (p * p + q * q) / (size * size);
        *relief = nz_smooth(-2 * e / size, 0.7f, d);
        *where = nz_smooth(-3 * e / size, 3 * e / size, d);
        break;
    }
    case STUDS: {
        float t = nz_min(1, r / (0.75f * size));
        *relief = __builtin_sqrtf(nz_max(0, 1 - t * t));
        *where = nz_smooth(0.75f * size + e, 0.75f * size - e, r);
        break;
    }
    case PYRAMIDS: {
        float edge = 0.5f - nz_max(nz_abs(x), nz_abs(y));
        *relief = nz_smooth(0.05f, 0.05f + 0.45f * size, edge);
        *where = nz_smooth(0.05f, 0.1f + 2 * e, edge);
        break;
    }
    case SCALES: {
        float t = nz_min(1, r), lip = nz_clamp(0.5f - y * 1.2f, 0, 1); /* each scale rises toward its lower rim */
        *relief = lip * (1 - 0.4f * t * t) * nz_smooth(0, 0.12f + e, cells->edge[i]);
        *where = nz_smooth(0, 0.1f + e, cells->edge[i]);
        break;
    }
    case HAMMERED: {
        *relief = nz_min(1, r * r * 1.6f);
        *where = *relief;
        break;
    }
    case HOLES: {
        *relief = nz_smooth(0.7f * size - 0.05f - e, 0.7f * size + 0.05f + e, r);
        *where = nz_smooth(0.7f * size - e, 0.7f * size + e, r);
        break;
    }
    case CARVED: { /* rosettes: petals around a knob in a ring; the number of petals by the cell's size */
        float turn = 0.15915494f * atan2f(y, x), petals = 4 + 2 * nz_floor(size * 10 - 2),
              leaf = 0.5f + 0.5f * nz_sine(petals * turn);
        float reach = size * (0.45f + 0.35f * leaf), knob = nz_smooth(0.22f * size + e, 0.12f * size, r);
        float petal = nz_smooth(reach + e, 0.7f * reach, r) * (0.35f + 0.65f * __builtin_sqrtf(leaf)),
              ring = nz_smooth(0.05f + e, 0, nz_abs(r - 0.9f * size));
        *relief = nz_max(nz_max(petal * nz_smooth(0.15f * size, 0.35f * size, r), knob), 0.7f * ring);
        *where = nz_smooth(0.1f, 0.3f, *relief);
        break;
    }
    default: {
        *relief = 0.5f + 0.5f * nz_sine(f->u[i]);
        *where = *relief;
    }
    }
}

void io_family_embossed(io_canvas *c)
{
    io_substance sheet, rest;
    if (cv_chance(c, 0.6f)) sheet = pal_metal(c, cv_log_range(c, 0.12f, 0.6f));
    else {
        io_rgb colour;
        pal_paint(c, colour);
        sheet = pal_dielectric(c, colour, cv_range(c, 0.15f, 0.8f));
    }
    rest = sheet;
    int shape = ts_rng_int(&c->rng, SHAPES);
    if (shape == CARVED && cv_chance(c, 0.7f)) { /* mostly of wood or stone */
        static const uint32_t carved[] = {0x6b4226, 0x4a2e1d, 0x8a5a34, 0x3a2016, 0x9a9084, 0xc8bfae, 0x5c5a58};
        io_rgb colour;
        pal_pick(c, carved, PAL_COUNT(carved), 0.4f, colour);
        rest = sheet = pal_dielectric(c, colour, cv_range(c, 0.15f, 0.7f));
    }
    if (shape == HOLES || cv_chance(c, 0.25f)) { /* what is between the shapes is another substance */
        io_rgb colour;
        pal_paint(c, colour);
        pal_scale(colour, shape == HOLES ? 0.2f : 0.7f);
        rest = pal_dielectric(c, colour, cv_range(c, 0.4f, 0.9f));
    }
    cv_fill(c, &rest);

    float rows = shape == CARVED ? cv_log_range(c, 1.2f, 6)
        : shape == HAMMERED      ? cv_log_range(c, 4, 16)
                                 : cv_log_range(c, 4, 22),
          unit = 1 / rows, jitter = shape == HAMMERED ? 0.9f : 0;
    bool stagger = shape == SCALES || shape == HAMMERED || cv_chance(c, 0.4f);
    nz_frame straight = cv_frame(c, rows, stagger ? 0.8660254f : 1,
                                 cv_chance(c, 0.4f) ? 0.125f * (float)ts_rng_int(&c->rng, 2) : cv_range(c, 0, 1));
    nz_frame f = cv_bend(c, straight, 0.2f, 2, cv_chance(c, 0.7f) ? 0.003f : cv_range(c, 0.01f, 0.1f));
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, jitter, stagger && shape != TREAD ? 0.5f : 0, cv_seed(c), cells);
    float size = cv_range(c, 0.35f, 0.6f), e = 0.5f * straight.step,
          high = cv_log_range(c, 0.05f, 0.3f) * nz_min(unit, 0.25f), *where = cv_plane(c), *relief = cv_plane(c);
    float some = cv_chance(c, 0.15f) ? cv_range(c, 0.3f, 0.8f) : 1, fade = nz_smooth(0.7f, 0.35f, straight.step);
    for (int i = 0; i < c->count; i++) {
        shape_at(shape, &cells, &f, i, size, e, &relief[i], &where[i]);
        if (nz_again(cells.id[i], 9) > some) relief[i] = where[i] = shape == HOLES;
        relief[i] *= fade;
        cells.near[i] = nz_again(cells.id[i], 1) - 0.5f;
    }
    if (shape == HAMMERED || shape == WAVES || cv_chance(c, 0.7f)) {
        cv_cover(c, where, 1, &sheet);
        if (shape == HAMMERED || shape == WAVES)
            for (int i = 0; i < c->count; i++) where[i] = 1;
        if (shape == HAMMERED || shape == WAVES) cv_cover(c, where, 1, &sheet);
    }
    cv_raise(c, relief, high);
    cv_shade(c, cells.near, cv_chance(c, 0.3f) ? cv_range(c, 0.1f, 0.5f) : 0.04f);
    for (int i = 0; i < c->count; i++) relief[i] -= 0.5f;
    cv_roughen(c, relief, cv_range(c, -0.25f, 0.15f));
    cv_shade(c, relief, cv_range(c, -0.1f, 0.5f));
    c->used = 0;
    float soft_turns = cv_range(c, 0, 1), soft_stretch = cv_range(c, 1, 3), soft_scale = cv_range(c, 1, 5);
    nz_frame soft = cv_bend(c, cv_frame(c, soft_scale, soft_stretch, soft_turns), 1, 3, 0.04f);
    float *tone = cv_noise(c, soft, NZ_SMOOTH, 1, 6, 0.65f);
    cv_roughen(c, tone, cv_range(c, 0.01f, 0.1f));
    cv_shade(c, tone, cv_range(c, 0.02f, 0.2f));
    if (cv_chance(c, 0.4f)) wear_edges(c, 0.25f * unit, cv_range(c, 0.1f, 0.7f), NULL);
    if (cv_chance(c, 0.4f)) wear_dirt(c, 0.3f * unit, cv_range(c, 0, 0.6f));
    wear_any(c, 0.4f);
}

void io_family_plastic(io_canvas *c)
{
    io_rgb a, b;
    pal_paint(c, a);
    pal_vary(c, a, 0.5f, b);
    io_substance s = pal_dielectric(c, a,
                                    cv_chance(c, 0.45f) ? cv_log_range(c, 0.06f, 0.35f) : cv_range(c, 0.35f, 0.9f));
    cv_fill(c, &s);
    int kind = ts_rng_int(&c->rng, 5);
    if (kind == 0) { /* eroded mould: fine even bumps */
        float scale = cv_log_range(c, 20, 70);
        nz_frame f = cv_frame(c, scale, 1, 0);
        float *bump = cv_noise(c, f, NZ_SMOOTH, 1, 2, 0.6f);
        cv_raise(c, bump, cv_log_range(c, 0.015f, 0.1f) / scale);
        cv_shade(c, bump, cv_range(c, 0, 0.08f));
    } else if (kind == 1) { /* ribs or grooves */
        float often = cv_log_range(c, 5, 28), flat = cv_range(c, 0, 0.9f),
              fade = nz_smooth(0.45f, 0.25f, often * c->pixel);
        nz_frame f = cv_frame(c, often, 1, cv_range(c, 0, 1));
        float *rib = cv_plane(c);
        for (int i = 0; i < c->count; i++) rib[i] = nz_smooth(-1 + flat, 1 - 0.7f * flat, nz_sine(f.u[i])) - 0.5f;
        cv_raise(c, rib, fade * cv_range(c, 0.05f, 0.3f) / often);
        cv_shade(c, rib, fade * cv_range(c, 0, 0.4f));
        cv_roughen(c, rib, fade * cv_range(c, -0.15f, 0.05f));
    } else if (kind == 2) { /* paper or board: pressed fibres */
        float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 5), scale = cv_log_range(c, 12, 40);
        nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.3f, 4, 0.25f);
        float *fibre = cv_noise(c, f, NZ_RIDGED, 0.6f, 4, 0.7f),
              *crumple = cv_noise(c, cv_frame(c, cv_range(c, 1, 4), 1, 0), NZ_RIDGED, 1, 4, 0.45f);
        cv_shade(c, fibre, cv_range(c, 0.02f, 0.12f));
        cv_raise(c, fibre, cv_log_range(c, 0.0001f, 0.0008f));
        if (cv_chance(c, 0.5f)) cv_raise(c, crumple, cv_log_range(c, 0.001f, 0.012f));
    } else if (kind == 3) { /* smooth, a little wavy; lacquer or enamel */
        nz_frame f = cv_frame(c, cv_range(c, 1, 12), 1, 0);
        float *wave = cv_noise(c, f, NZ_SMOOTH, 1, 3, 0.35f);
        cv_raise(c, wave, cv_log_range(c, 0.0002f, 0.003f));
        cv_roughen(c, wave, 0.01f);
    } else { /* speckled or marbled in the mass */
        nz_frame f = cv_bend(c, cv_frame(c, cv_log_range(c, 3, 25), 1, 0), 0.8f, 3, 0.05f);
        float *spot = cv_noise(c, f, NZ_SMOOTH, 1, 4, 0.6f);
        float blur = cv_range(c, 0.1f, 0.6f), coverage = cv_range(c, 0.1f, 0.6f);
        cv_threshold(c, spot, cv_level(coverage), blur);
        cv_tint(c, spot, 1, b);
        cv_roughen(c, spot, cv_range(c, -0.1f, 0.1f));
        cv_raise(c, spot, cv_range(c, 0, 0.001f));
    }
    c->used = 0;
    nz_frame soft = cv_frame(c, cv_range(c, 1, 4), 1, 0);
    float *tone = cv_noise(c, soft, NZ_SMOOTH, 1, 6, 0.65f);
    cv_shade(c, tone, cv_range(c, 0, 0.1f));
    cv_roughen(c, tone, cv_range(c, 0, 0.06f));
    wear_any(c, 0.3f);
}
