/* Cloth: plain, twill, satin and basket weaves, knits; stripes and checks; folds. */
#include "data/materials/family.h"

/* Whether the warp lies on top where warp thread i crosses weft thread j. */
static int warp_over(int weave, int i, int j)
{
    switch (weave) {
    case 0: return (i + j) & 1;
    case 1: return ((i + j) & 3) < 2;
    case 2: return ((unsigned)(i * 2 + j + 100000) % 5u) != 0;
    default: return ((i >> 1) + (j >> 1)) & 1;
    }
}

static void woven(io_canvas *c, nz_frame f, int weave, float fade, float *height, float *over, float *gap)
{
    float flat = weave == 2 ? 0.85f : 0.55f;
    for (int i = 0; i < c->count; i++) {
        float uf = nz_floor(f.u[i]), vf = nz_floor(f.v[i]), x = 2 * (f.u[i] - uf) - 1, y = 2 * (f.v[i] - vf) - 1;
        int top = warp_over(weave, (int)uf, (int)vf);
        float across = top ? x : y, along = top ? y : x, round = 1 - across * across,
              bow = flat + (1 - flat) * (1 - along * along);
        height[i] = fade * (round * bow - 0.5f);
        over[i] = nz_mix(0.5f, (float)top, fade);
        gap[i] = fade * (1 - nz_smooth(0, 0.5f, round));
    }
}

static void knitted(io_canvas *c, nz_frame f, float fade, float *height, float *over, float *gap)
{
    for (int i = 0; i < c->count; i++) {
        float uf = nz_floor(f.u[i]), a = 2 * nz_abs(f.u[i] - uf - 0.5f), t = f.v[i] - a * 0.9f,
              y = 2 * (t - nz_floor(t)) - 1, x = 2 * a - 1;
        float round = (1 - x * x) * (1 - 0.7f * y * y);
        height[i] = fade * (1.4f * round - 0.6f);
        over[i] = 0.5f;
        gap[i] = fade * (1 - nz_smooth(0.05f, 0.5f, round));
    }
}

/* Carpet, felt, towelling: tufts of pile instead of threads. */
static void piled(io_canvas *c, nz_frame f, float *height, float *over, float *gap)
{
    int mark = c->used;
    nz_cells tuft = cv_cells(c);
    float fade = nz_smooth(0.9f, 0.45f, f.step);
    nz_cell(f, 1, 0.9f, 0, cv_seed(c), tuft);
    nz_fbm(f, NZ_SMOOTH, 0.6f, 4, 0.9f, cv_seed(c), over);
    for (int i = 0; i < c->count; i++) {
        float round = 1 - nz_min(1, tuft.near[i] * 1.3f);
        height[i] = fade * (round - 0.4f) + 0.25f * over[i];
        gap[i] = fade * (1 - nz_smooth(0.1f, 0.6f, round + 0.2f * over[i]));
        over[i] = nz_mix(0.5f, tuft.id[i], fade);
    }
    cv_drop(c, mark);
}

void io_family_cloth(io_canvas *c)
{
    io_rgb a, b;
    pal_paint(c, a);
    if (cv_chance(c, 0.45f)) pal_vary(c, a, 0.3f, b);
    else pal_paint(c, b);
    bool silk = cv_chance(c, 0.2f);
    io_substance s = pal_dielectric(c, a, silk ? cv_range(c, 0.3f, 0.5f) : cv_range(c, 0.6f, 1));
    cv_fill(c, &s);

    enum { KNITTED = 4, PILED = 5 };
    int weave = ts_rng_int(&c->rng, 6);
    float threads = cv_log_range(c, 8, 60), unit = 1 / threads, fade = nz_smooth(0.55f, 0.28f, threads * c->pixel);
    float turns = cv_range(c, 0, 1);
    float stretch = weave >= KNITTED ? cv_range(c, 0.7f, 1.3f) : cv_chance(c, 0.7f) ? 1 : cv_range(c, 0.6f, 1.6f);
    nz_frame straight = cv_frame(c, threads, stretch, turns);
    nz_frame f = cv_bend(c, straight, 0.05f, 3, cv_range(c, 0.05f, 0.4f));
    float *height = cv_plane(c), *over = cv_plane(c), *gap = cv_plane(c);
    if (weave == KNITTED) knitted(c, f, fade, height, over, gap);
    else if (weave == PILED) piled(c, f, height, over, gap);
    else woven(c, f, weave, fade, height, over, gap);

    cv_raise(c, height, cv_range(c, 0.08f, 0.45f) * unit);
    cv_tint(c, over, weave == KNITTED ? 0 : 1, b);
    if (cv_chance(c, 0.3f)) { /* stripes or checks: threads dyed in groups */
        io_rgb d;
        pal_paint(c, d);
        float group = 1 / (threads * cv_log_range(c, 0.06f, 0.35f)), wide = cv_range(c, 0.2f, 0.6f);
        bool both = cv_chance(c, 0.5f);
        float *dyed = cv_plane(c);
        for (int i = 0; i < c->count; i++) {
            float p = f.u[i] * group, q = f.v[i] * group, edge = group * straight.step + 0.02f;
            p = nz_abs(p - nz_floor(p) - 0.5f);
            q = nz_abs(q - nz_floor(q) - 0.5f);
            float warp = nz_smooth(0.5f * wide + edge, 0.5f * wide - edge, p),
                  weft = both ? nz_smooth(0.5f * wide + edge, 0.5f * wide - edge, q) : 0;
            dyed[i] = both ? nz_mix(weft, warp, 1 - over[i]) : warp;
        }
        cv_tint(c, dyed, 0.95f, d);
    }
    /* Threads differ in thickness and dye; fibres run along and twist. */
    float *slub = cv_noise(c, f, NZ_SMOOTH, 0.3f, 4, 0.8f), *fuzz = cv_noise(c, straight, NZ_SMOOTH, 1.7f, 4, 0.8f);
    cv_shade(c, slub, cv_range(c, 0.03f, 0.18f));
    cv_shade(c, fuzz, cv_range(c, 0.05f, 0.2f));
    cv_raise(c, fuzz, cv_range(c, 0.005f, 0.03f) * unit);
    cv_shade(c, gap, -cv_range(c, 0.3f, 0.8f));
    cv_shade(c, height, cv_range(c, 0.1f, 0.5f));
    cv_roughen(c, gap, 0.15f);
    cv_roughen(c, over, silk ? cv_range(c, -0.15f, 0.15f) : cv_range(c, -0.05f, 0.05f));
    if (cv_chance(c, 0.4f)) { /* folds */
        float fold_turns = cv_range(c, 0, 1), fold_stretch = cv_range(c, 1, 4), folds = cv_range(c, 0.8f, 2.5f);
        nz_frame wide = cv_bend(c, cv_frame(c, folds, fold_stretch, fold_turns), 1, 2, 0.06f);
        float *fold = cv_noise(c, wide, cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_SMOOTH, 1, 3, 0.35f);
        cv_raise(c, fold, cv_log_range(c, 0.003f, 0.03f));
    }
    if (cv_chance(c, 0.15f)) { /* embroidery or print */
        io_rgb d;
        pal_paint(c, d);
        float motif_turns = cv_range(c, 0, 1), motifs = cv_range(c, 2, 7);
        nz_frame motif = cv_bend(c, cv_frame(c, motifs, 1, motif_turns), 1, 2, 0.03f);
        nz_cells cells = cv_cells(c);
        uint32_t seed = cv_seed(c);
        nz_cell(motif, 1, cv_chance(c, 0.5f) ? 0 : 0.5f, 0.5f, seed, cells);
        float radius = cv_range(c, 0.15f, 0.4f), petals = cv_range(c, 0, 3);
        for (int i = 0; i < c->count; i++) {
            float x = cells.x[i], y = cells.y[i], d2 = x * x + y * y;
            cells.edge[i] = nz_smooth(radius * radius + motif.step * radius, radius * radius * 0.9f,
                                      d2 + petals * x * x * y * y / (d2 + 0.01f));
        }
        cv_tint(c, cells.edge, 0.9f, d);
        cv_raise(c, cells.edge, 0.1f * unit);
    }
    wear_any(c, 0.2f);
}
