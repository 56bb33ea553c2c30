/* Leather: pebbled, creased, smooth; quilted or sewn from pieces. */
#include "data/materials/family.h"

static const uint32_t hide[] = {0x3b2418, 0x5a3520, 0x7a4a2c, 0x9c6a42, 0x1a1614, 0x0f0e0e, 0x2b1a14, 0x6b2a20,
                                0x4a1a18, 0xb58a60, 0xd6c4a8, 0x2a2f3a, 0x3a4034, 0x8a8278, 0x4b3a30, 0x181a20};

void io_family_leather(io_canvas *c)
{
    io_rgb a, worn;
    pal_pick(c, hide, PAL_COUNT(hide), 0.5f, a);
    pal_vary(c, a, 0.3f, worn);
    pal_scale(worn, cv_range(c, 1.3f, 2.5f));
    io_substance s = pal_dielectric(c, a, cv_range(c, 0.25f, 0.65f));
    cv_fill(c, &s);

    float scale = cv_log_range(c, 10, 55), unit = 1 / scale, fade = nz_smooth(0.7f, 0.3f, scale * c->pixel);
    float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 1.7f);
    nz_frame straight = cv_frame(c, scale, stretch, turns),
             f = cv_bend(c, straight, 0.3f, 4, cv_range(c, 0.05f, 0.25f));
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    float wide = cv_range(c, 0.12f, 0.4f), depth = cv_log_range(c, 0.03f, 0.3f) * unit * fade;
    float *pebble = cells.near, *fine = cv_noise(c, straight, NZ_SMOOTH, 1.5f, 4, 0.7f);
    for (int i = 0; i < c->count; i++) {
        float e = nz_clamp((cells.edge[i] + 0.04f * fine[i]) / wide, 0, 1);
        pebble[i] = e * (2 - e) - 0.6f;
    }
    cv_raise(c, pebble, depth);
    cv_raise(c, fine, cv_range(c, 0.002f, 0.015f) * unit);
    cv_shade(c, pebble, cv_range(c, 0.1f, 0.6f) * fade);
    cv_roughen(c, pebble, -cv_range(c, 0, 0.2f) * fade);
    if (cv_chance(c, 0.6f)) { /* creases over the grain */
        float crease_turns = cv_range(c, 0, 1), crease_stretch = cv_range(c, 1, 2.5f), creases = cv_range(c, 1.5f, 5);
        nz_frame large = cv_bend(c, cv_frame(c, creases, crease_stretch, crease_turns), 1, 3, 0.06f);
        float *crease = cv_noise(c, large, NZ_RIDGED, 1, 4, 0.5f);
        for (int i = 0; i < c->count; i++) crease[i] = nz_smooth(0.7f, 1.4f, crease[i]);
        cv_raise(c, crease, -cv_log_range(c, 0.001f, 0.008f));
        cv_shade(c, crease, -cv_range(c, 0.1f, 0.5f));
        cv_roughen(c, crease, cv_range(c, 0, 0.15f));
    }
    c->used = 0;
    nz_frame tone = cv_frame(c, cv_range(c, 1, 4), 1, 0);
    float *cloud = cv_noise(c, tone, NZ_SMOOTH, 1, 6, 0.65f), *mask = cv_plane(c);
    cv_shade(c, cloud, cv_range(c, 0.03f, 0.25f));
    cv_roughen(c, cloud, cv_range(c, 0, 0.08f));
    if (cv_chance(c, 0.45f)) { /* quilted, or tiles sewn together */
        float rows = cv_log_range(c, 1.5f, 6), size = 1 / rows,
              sewn_turns = cv_chance(c, 0.5f) ? 0.125f : cv_range(c, 0, 1);
        nz_frame sewn = cv_bend(c, cv_frame(c, rows, cv_range(c, 0.8f, 1.3f), sewn_turns), 1, 2, 0.015f);
        nz_brick_shape shape = {.loose = 0};
        shape.width = cv_chance(c, 0.6f) ? 1 : cv_range(c, 1, 2);
        shape.shift = cv_chance(c, 0.3f) ? 0.5f : 0;
        shape.round = cv_range(c, 0.01f, 0.15f);
        nz_cells piece = cv_cells(c);
        nz_brick(sewn, shape, cv_seed(c), piece);
        float pillow = cv_range(c, 0.1f, 0.5f), high = cv_range(c, 0.02f, 0.2f) * size,
              seam = cv_range(c, 0.01f, 0.03f), patch = cv_range(c, 0, 0.5f);
        float tilt = cv_range(c, 0, 0.1f) * size;
        for (int i = 0; i < c->count; i++) {
            float e = nz_clamp(piece.edge[i] / pillow, 0, 1), id = piece.id[i];
            c->height[i] += high * e * (2 - e) + tilt * (nz_again(id, 2) - 0.5f) * piece.x[i];
            mask[i] = nz_smooth(seam + sewn.step, seam, piece.edge[i]);
            piece.id[i] = nz_again(id, 1) - 0.5f;
        }
        cv_shade(c, piece.id, patch);
        cv_shade(c, mask, -0.6f);
        cv_roughen(c, mask, 0.2f);
        if (cv_chance(c, 0.6f)) { /* stitches beside the seams */
            io_rgb thread;
            pal_paint(c, thread);
            float often = cv_range(c, 6, 14), beside = seam + 0.04f;
            for (int i = 0; i < c->count; i++) {
                float x = piece.x[i], y = piece.y[i];
                bool upright = 0.5f * shape.width - nz_abs(x) < 0.5f - nz_abs(y);
                float t = (upright ? y : x) * often, p = 2 * nz_abs(t - nz_floor(t) - 0.5f);
                mask[i] = nz_smooth(0.018f + sewn.step, 0.006f, nz_abs(piece.edge[i] - beside)) *
                    nz_smooth(0.8f, 0.6f, p);
            }
            io_substance yarn = pal_dielectric(c, thread, 0.75f);
            cv_cover(c, mask, 0.95f, &yarn);
            cv_raise(c, mask, 0.008f * size);
        } else if (cv_chance(c, 0.4f)) { /* metal studs where the seams cross */
            io_substance stud = pal_metal(c, cv_range(c, 0.1f, 0.35f));
            float radius = cv_range(c, 0.06f, 0.13f);
            for (int i = 0; i < c->count; i++) {
                float x = 0.5f * shape.width - nz_abs(piece.x[i]), y = 0.5f - nz_abs(piece.y[i]),
                      d = (x * x + y * y) / (radius * radius);
                mask[i] = nz_smooth(1 + sewn.step / radius, 1 - sewn.step / radius, d);
                c->height[i] += size * radius * 0.8f * nz_bump(nz_min(1, d));
            }
            cv_cover(c, mask, 1, &stud);
        }
    }
    if (cv_chance(c, 0.5f)) {
        float *peak = cv_cavity(c, 0.01f);
        for (int i = 0; i < c->count; i++) peak[i] = nz_smooth(-0.05f, -0.6f, peak[i] - 0.25f * cloud[i]);
        cv_tint(c, peak, cv_range(c, 0.1f, 0.7f), worn);
    }
    wear_any(c, 0.3f);
}
