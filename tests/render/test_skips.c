/* What a vector of pixels does not need is not computed: a pixel that needs nothing gets the same bytes among its like,
 * where its vector is skipped, as beside pixels that need all. */
#include "render/kernels/newton.h"
#include "render/kernels/posterior.h"
#include "render/kernels/shade.h"
#include "render/rows.h"
#include "tensor/cpu.h"
#include "tests/support/shading.h"
#include <math.h>
#include <string.h>

enum { SIDE = 48, ROWS = 8 };

typedef struct scene {
    const char *name;
    rd_view view;
    bool burnt; /* needless pixels are above 1, and so is the photograph; else they do not see the light */
} scene;

/* Everything but what makes them needless is random. */
static void make_pixel(ts_rng *rng, const scene *s, bool needless, float *m, float *photo)
{
    for (int i = 0; i < C; i++) m[i] = ts_rng_range(rng, -0.9f, 0.9f);
    for (int i = 0; i < 2; i++) m[MAP_NORMAL + i] = ts_rng_range(rng, -0.3f, 0.3f);
    for (int c = 0; c < 3; c++) photo[c] = ts_rng_range(rng, 0.1f, 0.8f);
    if (!needless) {
        for (int c = 0; c < 3; c++) m[MAP_DIFFUSE + c] = m[MAP_SPECULAR + c] = -0.9f;
        m[MAP_ROUGHNESS] = 0.9f;
        return;
    }
    if (!s->burnt) m[MAP_NORMAL] = ts_rng_range(rng, -0.95f, -0.9f); /* away from the light */
    for (int c = 0; c < 3 && s->burnt; c++) {
        m[MAP_DIFFUSE + c] = ts_rng_range(rng, 0.8f, 1.1f); /* beyond 1 as well, where the maps are clamped */
        m[MAP_SPECULAR + c] = ts_rng_range(rng, -1.1f, -0.5f);
        photo[c] = ts_rng_range(rng, 0.95f, 1);
    }
}

typedef struct results {
    float image[SIDE * 3], flash[SIDE * C], loss[SIDE * C], step[SIDE * C];
    float probable[SIDE * C], after[SIDE * MAP_GROUPS];
} results;

static void compute(const scene *s, int y, const float *maps, const float *dark, const float *photo, results *r)
{
    const float damping[C] = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 1, 1, 1};
    const ts_prior prior = {{0.2f, 0.1f}, 0.1f, 0.5f, 0.3f, 0.5f};
    float deviation[SIDE * MAP_GROUPS];
    for (int i = 0; i < SIDE * MAP_GROUPS; i++) deviation[i] = 0.1f + 0.01f * (float)(i % 7);
    const rd_grid grid = rd_grid_full(SIDE);
    const ts_shade_view view = rd_shade_view(&s->view);
    ts_shade_row row = rd_shade_row(grid, 0, maps, C), other = rd_shade_row(grid, 0, dark, C);
    row.y = other.y = 0.5 - (y + 0.5) / SIDE;
    ts_shade_k()->render(&view, &row, 1, r->image);
    ts_shade_k()->flash(&view, &row, photo, 3, r->flash);
    ts_shade_k()->log_loss(&view, 1, &row, &other, 3, r->loss);
    ts_newton_k()->step(&view, &photo, 1, &row, damping, r->step);
    ts_posterior_k()->step(&view, &photo, 1, &row, &prior, dark, deviation, 1, NULL, r->probable, r->after);
}

static void compare(const char *isa, const scene *s, int y)
{
    static float maps[2][SIDE * C], photo[2][SIDE * 3], dark[SIDE * C];
    static results r[2];
    ts_rng rng = ts_rng_make(23, TS_STREAM_TEST, (uint64_t)y);
    for (int p = 0; p < SIDE; p++) {
        make_pixel(&rng, s, true, maps[0] + p * C, photo[0] + p * 3);
        memcpy(maps[1] + p * C, maps[0] + p * C, C * sizeof(float));
        memcpy(photo[1] + p * 3, photo[0] + p * 3, 3 * sizeof(float));
        if (p % 2) make_pixel(&rng, s, false, maps[1] + p * C, photo[1] + p * 3);
        for (int i = 0; i < C; i++)
            dark[p * C + i] = i < 3 || i >= MAP_SPECULAR ? -1 : maps[0][p * C + i]; /* sees what they see */
    }
    for (int k = 0; k < 2; k++) compute(s, y, maps[k], dark, photo[k], &r[k]);
    double gradient = 0, step = 0;
    for (int p = 0; p < SIDE; p++) {
        for (int i = 0; i < C && p % 2; i++)
            gradient += fabs((double)r[1].flash[p * C + i]), step += fabs((double)r[1].step[p * C + i]);
        if (p % 2) continue;
        CHECK(!memcmp(r[0].image + p * 3, r[1].image + p * 3, 3 * sizeof(float)),
              "%s, %s: pixel %d is shaded otherwise beside others", isa, s->name, p);
        CHECK(!memcmp(r[0].flash + p * C, r[1].flash + p * C, C * sizeof(float)),
              "%s, %s: pixel %d has another gradient beside others", isa, s->name, p);
        CHECK(!memcmp(r[0].loss + p * C, r[1].loss + p * C, C * sizeof(float)),
              "%s, %s: pixel %d has another gradient of the training loss beside others", isa, s->name, p);
        CHECK(!memcmp(r[0].step + p * C, r[1].step + p * C, C * sizeof(float)),
              "%s, %s: pixel %d goes elsewhere beside others", isa, s->name, p);
        CHECK(!memcmp(r[0].probable + p * C, r[1].probable + p * C, C * sizeof(float)) &&
                  !memcmp(r[0].after + p * MAP_GROUPS, r[1].after + p * MAP_GROUPS, MAP_GROUPS * sizeof(float)),
              "%s, %s: pixel %d is probably elsewhere beside others", isa, s->name, p);
        for (int c = 0; c < 3; c++)
            CHECK(r[0].image[p * 3 + c] == (s->burnt ? 1 : 0), "%s, %s: pixel %d has the value %g", isa, s->name, p,
                  (double)r[0].image[p * 3 + c]);
        for (int i = 0; i < C; i++)
            CHECK(r[0].flash[p * C + i] == 0, "%s, %s: pixel %d has a gradient", isa, s->name, p);
    }
    CHECK(gradient > 0 && step > 0, "%s, %s: the others need nothing either", isa, s->name);
}

TEST(skipped_vectors_are_what_they_would_have_been)
{
    const scene scenes[] = {
        {"burnt out by the flash", {.kind = RD_POINT, .light = {0, 0, 1}, .camera = {0, 0, 1}, .power = 60}, true},
        {"burnt out by a light apart",
         {.kind = RD_POINT, .light = {0.3f, 0.1f, 1}, .camera = {0, 0, 1}, .power = 80},
         true},
        {"turned away from the light",
         {.kind = RD_POINT, .light = {2, 0, 0.3f}, .camera = {0, 0, 1}, .power = 5},
         false},
    };
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++)
            for (int y = 0; y < ROWS; y++) compare(ts_isa_name((ts_isa)isa), &scenes[i], y * SIDE / ROWS);
    }
}
