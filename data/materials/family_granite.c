/* Grains of several minerals, cut and polished: granite, terrazzo, speckled plastic and composite. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

static const uint32_t minerals[] = {0xf2f0ea, 0xe6e0d6, 0xd8cfc4, 0xc9a898, 0xb5846e, 0x9a9a98, 0x77787a,
                                    0x5c5a58, 0x3a3a3c, 0x1a1a1c, 0x2e3a34, 0x7a6a50, 0xa09070, 0x58687a};

/* Grains over what is there: of the cells of one size those with a high number, in colours of their own. */
static void grains(io_canvas *c, float scale, float share, float flat)
{
    const int mark = c->used;
    const float stretch = cv_range(c, 1, 1.8f), turns = cv_range(c, 0, 1), bend = cv_range(c, 0, 0.3f),
                tones = cv_range(c, 0, 1), gloss = cv_chance(c, 0.3f) ? cv_range(c, -0.1f, 0.2f) : 0;
    const nz_frame f = cv_bend(c, cv_frame(c, scale, stretch, turns), 0.7f, 3, bend);
    nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 1, 0, cv_seed(c), cells);
    const float clumps = cv_log_range(c, 1, 6);
    float *where = cv_noise(c, cv_frame(c, 1, 1, 0), NZ_SMOOTH, clumps, 3, 0.6f);
    io_substance mineral[3];
    for (int k = 0; k < 3; k++) mineral[k] = fin_dielectric(c, minerals, PAL_COUNT(minerals), 0.1f, 0.4f);
    const float clouds = cv_range(c, 0, 0.3f), blend = 0.5f * flat;
    for (int i = 0; i < c->count; i++) {
        const float id = cells.id[i], own = nz_again(id, 2);
        const io_rgb *colour = &mineral[(int)(own * 2.999f)].diffuse;
        if (id > share + clouds * where[i]) continue;
        const float t = 1 - blend, light = 1 + tones * (nz_again(id, 1) - 0.5f);
        for (int k = 0; k < 3; k++)
            c->diffuse[k][i] = nz_mix(c->diffuse[k][i], nz_clamp((*colour)[k] * light, 0.004f, 0.9f), t);
        c->roughness[i] = nz_clamp(c->roughness[i] + gloss * own, 0.05f, 1);
    }
    cv_drop(c, mark);
}

void io_family_granite(io_canvas *c)
{
    const int finish = ts_rng_int(&c->rng, 8); /* 0 to 4: polished; 5, 6: honed; 7: flamed */
    const float least = finish < 5 ? 0.06f
        : finish < 7               ? 0.3f
                                   : 0.6f,
                most = finish < 5 ? 0.25f
        : finish < 7              ? 0.55f
                                  : 0.95f,
                roughness = cv_range(c, least, most);
    io_substance body = fin_dielectric(c, minerals, PAL_COUNT(minerals), least, most);
    body.roughness = roughness;
    cv_fill(c, &body);
    const int kinds = 1 + ts_rng_int(&c->rng, 3);
    const float fine = cv_log_range(c, 20, 110);
    for (int k = 0; k < kinds; k++) {
        const float scale = fine / cv_range(c, 1, 4), share = cv_range(c, 0.1f, 0.6f), flat = cv_range(c, 0, 0.6f);
        grains(c, scale, share, flat);
    }
    if (cv_chance(c, 0.5f)) { /* mica: small and dark */
        const float scale = cv_log_range(c, 60, 120), share = cv_range(c, 0.03f, 0.2f);
        grains(c, scale, share, 0);
    }
    c->used = 0;
    fin_level(c, 0.1f);
    const float unevenness = cv_log_range(c, 0.002f, finish < 7 ? 0.03f : 0.06f), cycles = cv_range(c, 1, 10);
    float *wave = cv_noise(c, cv_frame(c, 1, 1, 0), NZ_SMOOTH, cycles, 2, 0.4f);
    cv_raise(c, wave, unevenness / (6.2831853f * cycles));
    c->used = 0;
    if (finish == 7) fin_grain(c, 0.2f);
    else if (cv_chance(c, 0.2f)) fin_gloss(c);
    if (cv_chance(c, 0.15f)) wear_smudges(c, 0.08f);
}
