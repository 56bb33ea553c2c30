/* Bare metals: brushed, turned, sanded, cast, polished; and corroded ones. */
#include "data/materials/family.h"
#include <math.h>

/* Coordinates along and across circles around a point: turned discs. */
static void turn_around(io_canvas *c, nz_frame f, float fine, float along)
{
    float x0 = cv_range(c, -0.7f, 0.7f), y0 = cv_range(c, -0.7f, 0.7f);
    for (int i = 0; i < c->count; i++) {
        float x = c->x[i] - x0, y = c->y[i] - y0, r = sqrtf(x * x + y * y);
        f.u[i] = r * fine;
        f.v[i] = along * atan2f(y, x);
    }
}

void io_family_brushed(io_canvas *c)
{
    io_substance metal = pal_metal(c, cv_log_range(c, 0.12f, 0.6f));
    cv_fill(c, &metal);
    int finish = ts_rng_int(&c->rng, 5);
    if (finish <= 1) { /* long strokes; sometimes turned on a lathe */
        float fine = cv_log_range(c, 20, 90), turns = cv_range(c, 0, 1);
        nz_frame f = cv_frame(c, fine, cv_log_range(c, 20, 120), turns);
        if (cv_chance(c, 0.2f)) turn_around(c, f, fine, cv_range(c, 0.5f, 3));
        else f.step = c->pixel * fine * (0.35f + 0.65f * nz_abs(cosf(turns * 6.2831853f)));
        f.step = nz_min(
            f.step,
            0.45f); /* strokes finer than a pixel still show as streaks: some of their contrast survives the average */
        float *stroke = cv_noise(c, f, NZ_SMOOTH, 0.25f, 4, 0.8f), *broad = cv_noise(c, f, NZ_SMOOTH, 0.05f, 3, 0.7f);
        cv_roughen(c, stroke, cv_range(c, 0.01f, 0.06f));
        cv_roughen(c, broad, cv_range(c, 0, 0.06f));
        cv_shade(c, stroke, cv_range(c, 0.02f, 0.15f));
        cv_shade(c, broad, cv_range(c, 0, 0.1f));
        cv_raise(c, stroke, cv_log_range(c, 0.005f, 0.06f) / fine);
    } else if (finish == 2) { /* cast or sand-blasted */
        float fine = cv_log_range(c, 8, 50);
        nz_frame f = cv_frame(c, fine, 1, 0);
        float *bump = cv_noise(c, f, cv_chance(c, 0.5f) ? NZ_SMOOTH : NZ_BILLOW, 1, 3, 0.6f);
        cv_raise(c, bump, cv_log_range(c, 0.01f, 0.08f) / fine);
        cv_roughen(c, bump, cv_range(c, 0, 0.06f));
        cv_roughen(c, bump, 0.04f);
        cv_shade(c, bump, cv_range(c, 0, 0.15f));
    } else if (finish == 3) { /* rolled sheet with dents */
        float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 3), scale = cv_range(c, 1, 4);
        nz_frame f = cv_frame(c, scale, stretch, turns);
        float *dent = cv_noise(c, f, NZ_SMOOTH, 1, 3, 0.4f);
        cv_raise(c, dent, cv_log_range(c, 0.001f, 0.01f));
        float *spot = cv_noise(c, f, NZ_SMOOTH, 3, 5, 0.7f);
        cv_roughen(c, spot, cv_range(c, 0.01f, 0.08f));
        cv_shade(c, spot, cv_range(c, 0.01f, 0.15f));
    } else { /* patina: clouds of tone and roughness */
        nz_frame f = cv_bend(c, cv_frame(c, cv_log_range(c, 1, 5), 1, 0), 1, 3, 0.06f);
        float *cloud = cv_noise(c, f, NZ_SMOOTH, 1, 6, 0.6f), *spot = cv_noise(c, f, NZ_SMOOTH, 3, 5, 0.7f);
        cv_roughen(c, cloud, cv_range(c, 0.03f, 0.14f));
        cv_roughen(c, spot, cv_range(c, 0, 0.06f));
        cv_shade(c, cloud, cv_range(c, -0.25f, 0.25f));
        cv_shade(c, spot, cv_range(c, 0, 0.12f));
    }
    if (cv_chance(c, 0.5f)) {
        float longest = cv_log_range(c, 0.1f, 1);
        wear_scratches(c, 5 + ts_rng_int(&c->rng, 60), longest, NULL);
    }
    if (cv_chance(c, 0.4f)) wear_smudges(c, 0.12f);
    wear_any(c, 0.3f);
}

void io_family_rust(io_canvas *c)
{
    static const uint32_t iron[] = {0x6b3a20, 0x8a4a24, 0x52301f, 0xa5602c, 0x3c2620, 0x7d3b1e, 0xb5763a, 0x2c201c};
    static const uint32_t copper[] = {0x5a8f7c, 0x3f7a6a, 0x86b09a, 0x2f5a50, 0x6b8a5f, 0x2a3a34};
    io_substance metal = pal_metal(c, cv_log_range(c, 0.15f, 0.6f));
    bool green = cv_chance(c, 0.15f);
    if (green) {
        io_rgb f0 = {0.9f, 0.58f, 0.46f};
        float age = cv_range(c, 0.3f, 1);
        for (int k = 0; k < 3; k++) metal.specular[k] = f0[k] * age;
    }
    const uint32_t *list = green ? copper : iron;
    int length = green ? PAL_COUNT(copper) : PAL_COUNT(iron);
    io_rgb a, b, d;
    pal_pick(c, list, length, 0.4f, a);
    pal_pick(c, list, length, 0.6f, b);
    pal_pick(c, list, length, 0.6f, d);
    io_substance rust = pal_dielectric(c, a, cv_range(c, 0.65f, 1));
    cv_fill(c, &metal);

    float scale = cv_log_range(c, 1.2f, 5), turns = cv_range(c, 0, 1),
          stretch = cv_chance(c, 0.3f) ? cv_range(c, 0.3f, 3) : 1;
    nz_frame f = cv_frame(c, scale, stretch, turns), bent = cv_bend(c, f, 1, 4, cv_range(c, 0.01f, 0.06f));
    float *cloud = cv_noise(c, bent, NZ_SMOOTH, 2, 5, 0.65f);
    cv_roughen(c, cloud, cv_range(c, 0.01f, 0.08f));
    cv_shade(c, cloud, cv_range(c, 0, 0.2f));
    if (cv_chance(c, 0.35f)) { /* rests of a coat of paint, that the rust creeps under */
        io_rgb p;
        pal_paint(c, p);
        io_substance paint = pal_dielectric(c, p, cv_range(c, 0.25f, 0.7f));
        float *coat = cv_noise(c, bent, NZ_SMOOTH, 0.7f, 5, 0.6f);
        cv_threshold(c, coat, cv_level(cv_range(c, 0.3f, 0.9f)), 0.05f);
        cv_cover(c, coat, 1, &paint);
        cv_raise(c, coat, 0.0015f);
    }
    float *mask = cv_noise(c, bent, NZ_SMOOTH, 1, 7, cv_range(c, 0.5f, 0.72f));
    float coverage = cv_chance(c, 0.25f) ? cv_range(c, 0.85f, 1) : cv_range(c, 0.1f, 0.85f),
          width = cv_log_range(c, 0.06f, 0.6f);
    cv_threshold(c, mask, cv_level(coverage), width);
    cv_cover(c, mask, 1, &rust);
    float *fine = cv_noise(c, bent, NZ_SMOOTH, 5, 5, 0.7f), *mix = cv_plane(c);
    for (int i = 0; i < c->count; i++) mix[i] = nz_smooth(-0.3f, 1, cloud[i]) * mask[i];
    cv_tint(c, mix, 1, b);
    for (int i = 0; i < c->count; i++) mix[i] = nz_smooth(0.2f, 1.2f, fine[i]) * mask[i];
    cv_tint(c, mix, 0.8f, d);
    for (int i = 0; i < c->count; i++) mix[i] = fine[i] * mask[i];
    cv_shade(c, mix, cv_range(c, 0.1f, 0.3f));
    cv_roughen(c, mix, cv_range(c, 0, 0.08f));
    float relief = cv_log_range(c, 0.002f, 0.03f) / scale;
    cv_raise(c, mix, relief * 0.4f);
    cv_raise(c, mask, cv_chance(c, 0.6f) ? relief : -relief);
    if (cv_chance(c, 0.3f)) { /* what the rain washed down */
        float narrow = cv_range(c, 6, 15), often = cv_range(c, 8, 20);
        nz_frame down = cv_frame(c, often, narrow, 0);
        float *streak = cv_noise(c, down, NZ_SMOOTH, 1, 3, 0.6f);
        cv_threshold(c, streak, cv_range(c, 0.2f, 1.2f), 0.8f);
        cv_cover(c, streak, cv_range(c, 0.2f, 0.7f), &rust);
    }
    if (cv_chance(c, 0.4f)) {
        float longest = cv_log_range(c, 0.1f, 0.8f);
        wear_scratches(c, 3 + ts_rng_int(&c->rng, 30), longest, &metal);
    }
    wear_any(c, 0.6f);
}
