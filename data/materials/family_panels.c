/* Panels of metal or plastic: seams, insets, rivets, screws, slots, grilles, each a part of another substance. */
#include "data/materials/family.h"

/* Distance from the nearest of the points that lie spacing apart along a rectangle's border, inset from it; half sizes
 * w, h. */
static float along_border(float x, float y, float w, float h, float spacing)
{
    float px = nz_abs(x), py = nz_abs(y);
    float tx = px / spacing, ty = py / spacing, rx = px - spacing * nz_min(nz_floor(tx + 0.5f), nz_floor(w / spacing)),
          ry = py - spacing * nz_min(nz_floor(ty + 0.5f), nz_floor(h / spacing));
    float upright = (px - w) * (px - w) + ry * ry, level = (py - h) * (py - h) + rx * rx;
    return __builtin_sqrtf(nz_min(upright, level));
}

static io_substance part(io_canvas *c, float metal)
{
    if (cv_chance(c, metal)) return pal_metal(c, cv_range(c, 0.15f, 0.65f));
    io_rgb colour;
    pal_paint(c, colour);
    return pal_dielectric(c, colour, cv_range(c, 0.2f, 0.75f));
}

void io_family_panels(io_canvas *c)
{
    float metallic = cv_chance(c, 0.5f) ? 0.2f : 0.7f;
    io_substance sheet = part(c, metallic), other = part(c, metallic), trim = part(c, 0.6f), hole = part(c, 0.2f);
    for (int k = 0; k < 3; k++) {
        hole.diffuse[k] *= 0.15f;
        hole.specular[k] = nz_max(0.02f, hole.specular[k] * 0.4f);
    }
    hole.roughness = nz_clamp(hole.roughness + 0.2f, 0, 1);
    cv_fill(c, &sheet);

    float rows = cv_log_range(c, 1, 5), unit = 1 / rows;
    nz_frame f = cv_frame(c, rows, 1, cv_chance(c, 0.75f) ? 0.25f * (float)ts_rng_int(&c->rng, 2) : cv_range(c, 0, 1));
    nz_brick_shape shape;
    shape.width = cv_range(c, 0.6f, 2.5f);
    shape.shift = cv_chance(c, 0.5f) ? 0.5f : 0;
    shape.loose = cv_chance(c, 0.3f) ? 1 : 0;
    shape.round = cv_chance(c, 0.5f) ? 0.02f : cv_range(c, 0.05f, 0.25f);
    nz_cells cells = cv_cells(c);
    nz_brick(f, shape, cv_seed(c), cells);
    float e = f.step, gap = cv_range(c, 0.006f, 0.03f), bevel = cv_range(c, 0.01f, 0.05f) + 0.5f * e,
          depth = cv_range(c, 0.008f, 0.04f) * unit;
    float w = 0.5f * shape.width, *a = cv_plane(c), *b = cv_plane(c), *d = cv_plane(c);

    /* Every second panel or so of the other substance; then what a panel carries, by its number. */
    float share = cv_chance(c, 0.5f) ? 0 : cv_range(c, 0.2f, 0.6f), spread = cv_range(c, 0, 0.3f);
    for (int i = 0; i < c->count; i++) {
        a[i] = nz_again(cells.id[i], 1) < share;
        b[i] = nz_again(cells.id[i], 2) - 0.5f;
        c->height[i] += depth * nz_smooth(gap, gap + bevel, cells.edge[i]);
    }
    cv_cover(c, a, 1, &other);
    cv_shade(c, b, spread);
    cv_roughen(c, b, cv_range(c, 0, 0.25f));

    float inset = cv_range(c, 0.1f, 0.25f), inset_share = cv_range(c, 0, 0.7f),
          inset_depth = cv_range(c, -0.03f, 0.03f) * unit;
    for (int i = 0; i < c->count; i++) {
        float here = nz_again(cells.id[i], 3) < inset_share, in = nz_smooth(inset, inset + bevel, cells.edge[i]);
        a[i] = here * in;
    }
    cv_raise(c, a, inset_depth);
    if (cv_chance(c, 0.5f)) cv_cover(c, a, 1, &trim);

    float open_share = cv_chance(c, 0.45f) ? cv_range(c, 0.2f, 0.8f) : 0;
    if (open_share > 0) { /* slots, round holes or a honeycomb */
        int kind = ts_rng_int(&c->rng, 3);
        float often = cv_log_range(c, 4, 12), thick = cv_range(c, 0.25f, 0.4f), margin = inset + 0.02f, de = often * e;
        nz_cells comb = cv_cells(c);
        nz_frame local = {c->count, cells.x, cells.y, e};
        for (int i = 0; i < c->count; i++) d[i] = cells.y[i] * 1.1547005f;
        local.v = kind == 2 ? d : cells.y;
        nz_cell(local, often, 0, kind == 2 ? 0.5f : 0, 1, comb);
        for (int i = 0; i < c->count; i++) {
            float t = cells.y[i] * often, slot = thick - nz_abs(t - nz_floor(t) - 0.5f), round = thick - comb.near[i],
                  cell = comb.edge[i] - (0.5f - thick);
            float in = nz_min(kind == 0 ? slot : kind == 1 ? round : cell, (cells.edge[i] - margin) * often);
            a[i] = nz_again(cells.id[i], 4) < open_share ? nz_smooth(-0.5f * de - 0.03f, 0.5f * de + 0.03f, in) : 0;
        }
        cv_cover(c, a, 1, &hole);
        cv_raise(c, a, -cv_range(c, 0.05f, 0.25f) * unit / often);
        cv_drop(c, c->used - 5);
    }
    if (cv_chance(c, 0.6f)) { /* rivets or screws along the borders */
        float radius = cv_range(c, 0.015f, 0.04f), from = gap + bevel + 2 * radius,
              spacing = cv_range(c, 4, 14) * radius;
        bool corners = cv_chance(c, 0.4f), screws = cv_chance(c, 0.4f), of_trim = cv_chance(c, 0.6f);
        for (int i = 0; i < c->count; i++) {
            float x = cells.x[i], y = cells.y[i], hw = nz_max(w - from, 0.01f), hh = nz_max(0.5f - from, 0.01f);
            float cx = nz_abs(x) - hw, cy = nz_abs(y) - hh;
            float r = corners ? __builtin_sqrtf(cx * cx + cy * cy) : along_border(x, y, hw, hh, spacing);
            float t = nz_min(1, r / radius), head = nz_smooth(radius + 0.5f * e, radius - 0.5f * e, r);
            a[i] = head;
            float cross = screws
                ? nz_smooth(0.25f * radius, 0.1f * radius, nz_abs(nz_again(cells.id[i], 8) < 0.5f ? cx + cy : cx - cy))
                : 0;
            c->height[i] += unit * radius * (0.55f * (1 - t * t) * (screws ? 0.4f : 1) - 0.3f * cross * head);
        }
        if (of_trim) cv_cover(c, a, 1, &trim);
        else cv_roughen(c, a, cv_range(c, -0.1f, 0.1f));
    }
    if (cv_chance(c, 0.3f)) { /* ribs pressed into the sheet */
        float often = (float)(2 + ts_rng_int(&c->rng, 6)), flat = cv_range(c, 0.2f, 0.9f),
              rib_share = cv_range(c, 0.2f, 1);
        for (int i = 0; i < c->count; i++) {
            float wave = nz_smooth(-1 + flat, 1 - 0.8f * flat, nz_sine(cells.x[i] * often)) *
                nz_smooth(inset, inset + 0.08f, cells.edge[i]);
            a[i] = nz_again(cells.id[i], 5) < rib_share ? wave : 0;
        }
        cv_raise(c, a, cv_range(c, 0.03f, 0.15f) * unit / often);
    }
    for (int i = 0; i < c->count; i++) a[i] = nz_smooth(gap + 0.6f * e, gap - 0.4f * e, cells.edge[i]);
    cv_cover(c, a, 1, &hole);
    c->used = 0;
    float soft_turns = 0.25f * (float)ts_rng_int(&c->rng, 2), soft_stretch = cv_range(c, 1, 3),
          soft_scale = cv_range(c, 2, 6);
    nz_frame soft = cv_frame(c, soft_scale, soft_stretch, soft_turns);
    float *tone = cv_noise(c, soft, NZ_SMOOTH, 1, 6, 0.7f);
    cv_roughen(c, tone, cv_range(c, 0.01f, 0.08f));
    cv_shade(c, tone, cv_range(c, 0, 0.12f));
    c->used = 0;
    if (cv_chance(c, 0.35f)) wear_decals(c);
    if (cv_chance(c, 0.5f)) {
        io_substance bare = pal_metal(c, cv_range(c, 0.2f, 0.5f));
        float worn = cv_range(c, 0, 0.6f), edge_radius = cv_range(c, 0.008f, 0.02f);
        wear_edges(c, edge_radius, worn, &bare);
    }
    if (cv_chance(c, 0.4f)) wear_dirt(c, 0.02f, cv_range(c, 0, 0.6f));
    wear_any(c, 0.4f);
}
