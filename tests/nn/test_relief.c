/* How much relief a photograph shows, by what the network expects its errors to be. */
#include "nn/first_guess.h"
#include "nn/model.h"
#include "nn/relief.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { PIXELS = 20000 + 7, C = MAP_CHANNELS, STATED = GROUP_NORMAL };
static float maps[PIXELS * C], before[PIXELS * C], spread[PIXELS * NN_SPREADS];

/* Slopes of this mean length in drawn directions, beside other channels that are drawn; expected errors of 0.08. */
static void make(float slope)
{
    ts_rng rng = ts_rng_make(5, 0, 0);
    for (int i = 0; i < PIXELS * C; i++) maps[i] = ts_rng_range(&rng, -1, 1);
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) spread[i] = ts_rng_range(&rng, -3, 1);
    for (int i = 0; i < PIXELS; i++) {
        const float turn = ts_rng_range(&rng, 0, 6.2831853f), length = slope * ts_rng_range(&rng, 0.5f, 1.5f);
        maps[i * C + MAP_NORMAL] = length * cosf(turn), maps[i * C + MAP_NORMAL + 1] = length * sinf(turn);
        spread[i * NN_SPREADS + STATED] = logf(0.08f / NN_SPREAD_UNIT);
    }
    memcpy(before, maps, sizeof maps);
}

/* The factor of all slopes; NAN where there is more than one, or where another channel moved. */
static double factor(float steeper)
{
    nn_weigh_relief(PIXELS, C, spread, steeper, 1, maps);
    double times = NAN;
    for (int i = 0; i < PIXELS * C; i++) {
        const bool slope = i % C == MAP_NORMAL || i % C == MAP_NORMAL + 1;
        if (!slope && maps[i] != before[i]) return NAN;
        if (!slope || fabsf(before[i]) < 1e-4f) continue;
        const double here = (double)maps[i] / (double)before[i];
        if (isnan(times)) times = here;
        if (fabs(here - times) > 1e-4) return NAN;
    }
    return times;
}

TEST(relief_below_its_errors_is_none)
{
    static const struct {
        float part; /* of the expected error */
        double factor;
    } of[] = {{0.05f, 0}, {0.09f, 0}, {0.175f, 0.5}, {0.27f, 1}, {2, 1}};
    for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
        make(of[k].part * 0.08f);
        const double is = factor(1);
        CHECK(fabs(is - of[k].factor) < 0.02, "%g of the error: slopes times %g", (double)of[k].part, is);
        make(of[k].part * 0.08f);
        const double steep = factor(NN_RELIEF_STEEPER);
        CHECK(fabs(steep - (double)NN_RELIEF_STEEPER * is) < 1e-4, "%g of the error, made steeper: slopes times %g",
              (double)of[k].part, steep);
    }
}

TEST(relief_stays_within_what_maps_hold)
{
    static float one[PIXELS * C];
    make(0.95f);
    nn_weigh_relief(PIXELS, C, spread, NN_RELIEF_STEEPER, 1, maps);
    memcpy(one, maps, sizeof one);
    int held = 0;
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 2; k++) {
            const float n = maps[i * C + MAP_NORMAL + k];
            CHECK(n >= -1 && n <= 1, "a slope of %g", (double)n);
            held += fabsf(n) == 1;
        }
    CHECK(held > 0, "no slope reached what maps can hold");
    memcpy(maps, before, sizeof maps);
    nn_weigh_relief(PIXELS, C, spread, NN_RELIEF_STEEPER, 3, maps);
    CHECK(memcmp(one, maps, sizeof one) == 0, "three threads make other normals than one");
}

/* The slope of the first pixel that a first guess begins with, of a network that said .2 everywhere. */
static double settled(int known, int photographs)
{
    enum { SIDE = 64 };
    static float r0[SIDE * SIDE * C], image[SIDE * SIDE * 3], deviation[SIDE * SIDE * NN_SPREADS];
    const float scene[2 * RD_SCENE_NUMBERS] = {0};
    const nn_taken taken = {rd_flash(), known, photographs};
    ts_status st = {0};
    for (int i = 0; i < SIDE * SIDE * C; i++) r0[i] = i % C == MAP_NORMAL ? 0.2f : i % C == MAP_NORMAL + 1 ? 0 : -0.4f;
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = 0.3f;
    for (int i = 0; i < SIDE * SIDE * NN_SPREADS; i++) spread[i] = -1;
    nn_first_guess guess = {.r0 = r0, .spread = spread, .deviation = deviation};
    ts_arena *arena = ts_arena_create(0, &st);
    CHECK(arena && nn_first_guess_settle(rd_grid_full(SIDE), C, image, scene, &taken, arena, &guess, &st) == TS_OK,
          "%s", st.message);
    ts_arena_destroy(&arena);
    return (double)r0[MAP_NORMAL];
}

TEST(relief_is_steeper_where_one_photograph_alone_tells_it)
{
    enum { PLACES = NN_KNOWN_CAMERA | NN_KNOWN_LIGHT };
    const double alone = settled(PLACES, 1), told = settled(NN_KNOWN_ALL, 1), several = settled(PLACES, 2);
    CHECK(fabs(alone - 0.2 * (double)NN_RELIEF_STEEPER) < 1e-5, "power not known: a slope of %g", alone);
    CHECK(fabs(told - 0.2) < 1e-5, "power known: a slope of %g", told);
    CHECK(fabs(several - 0.2) < 1e-5, "two photographs: a slope of %g", several);
}
