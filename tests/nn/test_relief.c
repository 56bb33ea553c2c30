/* How much relief a photograph shows, by what the network expects its errors to be. */
#include "nn/first_guess.h"
#include "nn/model.h"
#include "nn/relief.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 141, PIXELS = SIDE * SIDE, C = MAP_CHANNELS, STATED = GROUP_NORMAL };
static float maps[PIXELS * C], before[PIXELS * C], spread[PIXELS * NN_SPREADS];

/* Channels that are drawn, and expected errors of normals of 0.08. */
static ts_rng draw(void)
{
    ts_rng rng = ts_rng_make(5, 0, 0);
    for (int i = 0; i < PIXELS * C; i++) maps[i] = ts_rng_range(&rng, -1, 1);
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) spread[i] = ts_rng_range(&rng, -3, 1);
    for (int i = 0; i < PIXELS; i++) spread[i * NN_SPREADS + STATED] = logf(0.08f / NN_SPREAD_UNIT);
    return rng;
}

/* Slopes of this mean length in drawn directions. */
static void make(float slope)
{
    ts_rng rng = draw();
    for (int i = 0; i < PIXELS; i++) {
        const float turn = ts_rng_range(&rng, 0, 6.2831853f), length = slope * ts_rng_range(&rng, 0.5f, 1.5f);
        maps[i * C + MAP_NORMAL] = length * cosf(turn), maps[i * C + MAP_NORMAL + 1] = length * sinf(turn);
    }
    memcpy(before, maps, sizeof maps);
}

static void weigh(bool steeper, int threads)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    CHECK(arena && nn_weigh_relief(SIDE, C, spread, steeper, threads, arena, maps, &st) == TS_OK, "%s", st.message);
    ts_arena_destroy(&arena);
}

/* Rise over run of a normal's channel 0 or 1: n / n_z. */
static double slope_of(const float *pixel, int k)
{
    const double x = (double)pixel[MAP_NORMAL], y = (double)pixel[MAP_NORMAL + 1];
    return (k ? y : x) / sqrt(1 - x * x - y * y);
}

/* The factor of all slopes; NAN where there is more than one, or where another channel moved. */
static double factor(void)
{
    weigh(false, 1);
    double times = NAN;
    for (int i = 0; i < PIXELS * C; i++) {
        const bool slope = i % C == MAP_NORMAL || i % C == MAP_NORMAL + 1;
        if (!slope && maps[i] != before[i]) return NAN;
        if (!slope || fabsf(before[i]) < 1e-4f) continue;
        const float *was = &before[i / C * C], *now = &maps[i / C * C];
        const double here = slope_of(now, i % C - MAP_NORMAL) / slope_of(was, i % C - MAP_NORMAL);
        if (isnan(times)) times = here;
        if (!(fabs(here - times) <= 1e-4)) return NAN;
    }
    return times;
}

static const struct {
    float part; /* of the expected error */
    double factor;
} relief_of[] = {{0.05f, 0}, {0.09f, 0}, {0.175f, 0.5}, {0.27f, 1}, {2, 1}};
enum { RELIEFS = sizeof relief_of / sizeof *relief_of };

TEST(relief_below_its_errors_is_none)
{
    for (int k = 0; k < RELIEFS; k++) {
        make(relief_of[k].part * 0.08f);
        const double is = factor();
        CHECK(fabs(is - relief_of[k].factor) < 0.02, "%g of the error: slopes times %g", (double)relief_of[k].part, is);
    }
}

/* x has a slope of one size everywhere, y one that changes its sign from pixel to pixel. */
TEST(relief_that_is_broad_gets_steeper_than_what_is_fine)
{
    for (int k = 0; k < RELIEFS; k++) {
        const float size = relief_of[k].part * 0.08f / sqrtf(2);
        draw();
        for (int i = 0; i < PIXELS; i++) {
            maps[i * C + MAP_NORMAL] = size;
            maps[i * C + MAP_NORMAL + 1] = (i / SIDE + i % SIDE) % 2 ? size : -size;
        }
        memcpy(before, maps, sizeof maps);
        weigh(true, 1);
        for (int i = 0; i < PIXELS * C; i++) {
            const int c = i % C - MAP_NORMAL;
            if (c != 0 && c != 1) {
                CHECK(maps[i] == before[i], "another channel moved");
                continue;
            }
            const double times = c ? (double)NN_RELIEF_FINE : (double)NN_RELIEF_BROAD,
                         is = slope_of(&maps[i / C * C], c) / slope_of(&before[i / C * C], c) / times;
            CHECK(fabs(is - relief_of[k].factor) <= 0.03, "%g of the error, %s: slopes times %g",
                  (double)relief_of[k].part, c ? "fine" : "broad", is * times);
        }
    }
}

/* What cells show are means of slopes: a steep pixel counts in them as much as it rises. */
TEST(relief_of_a_steep_pixel_in_a_lean_is_that_of_slopes)
{
    draw();
    for (int i = 0; i < PIXELS; i++) maps[i * C + MAP_NORMAL] = 0.2f, maps[i * C + MAP_NORMAL + 1] = 0;
    float *steep = &maps[(SIDE / 2 * SIDE + SIDE / 2) * C];
    steep[MAP_NORMAL] = 0.8f;
    const double lean = 0.2 / sqrt(1 - 0.04), rise = 0.8 / 0.6, fine = (double)NN_RELIEF_FINE,
                 expected = fine * rise + ((double)NN_RELIEF_BROAD - fine) * lean;
    weigh(true, 1);
    CHECK(fabs(slope_of(steep, 0) - expected) < 0.04, "a slope of %g, about %g is right", slope_of(steep, 0), expected);
}

/* Also from what no normal is: x and y together longer than 1. */
TEST(relief_stays_a_normal)
{
    static float one[PIXELS * C];
    make(0.8f);
    weigh(true, 1);
    memcpy(one, maps, sizeof one);
    int longer = 0;
    for (int i = 0; i < PIXELS; i++) {
        const float *n = &maps[i * C + MAP_NORMAL], *was = &before[i * C + MAP_NORMAL];
        longer += was[0] * was[0] + was[1] * was[1] > 1;
        CHECK(n[0] * n[0] + n[1] * n[1] < 1, "a normal (%g, %g)", (double)n[0], (double)n[1]);
    }
    CHECK(longer > 0, "all are normals before");
    memcpy(maps, before, sizeof maps);
    weigh(true, 3);
    CHECK(memcmp(one, maps, sizeof one) == 0, "three threads make other normals than one");
}

/* The slope of the first pixel that a first guess begins with, of a network that said .2 everywhere. */
static double settled(int known, int photographs)
{
    enum { S = 64 };
    static float r0[S * S * C], image[S * S * 3], deviation[S * S * NN_SPREADS];
    const float scene[2 * RD_SCENE_NUMBERS] = {0};
    const nn_taken taken = {.view = rd_flash(), .known = known, .photographs = photographs};
    ts_status st = {0};
    for (int i = 0; i < S * S * C; i++) r0[i] = i % C == MAP_NORMAL ? 0.2f : i % C == MAP_NORMAL + 1 ? 0 : -0.4f;
    for (int i = 0; i < S * S * 3; i++) image[i] = 0.3f;
    for (int i = 0; i < S * S * NN_SPREADS; i++) spread[i] = -1;
    nn_first_guess guess = {.r0 = r0, .spread = spread, .deviation = deviation};
    ts_arena *arena = ts_arena_create(0, &st);
    CHECK(arena && nn_first_guess_settle(rd_grid_full(S), C, image, scene, &taken, arena, &guess, &st) == TS_OK, "%s",
          st.message);
    ts_arena_destroy(&arena);
    return slope_of(r0, 0);
}

TEST(relief_is_steeper_where_one_photograph_alone_tells_it)
{
    enum { PLACES = NN_KNOWN_CAMERA | NN_KNOWN_LIGHT };
    const double alone = settled(PLACES, 1), told = settled(NN_KNOWN_ALL, 1), several = settled(PLACES, 2);
    const double said = 0.2 / sqrt(1 - 0.2 * 0.2);
    CHECK(fabs(alone - said * (double)NN_RELIEF_BROAD) < 1e-5, "power not known: a slope of %g", alone);
    CHECK(fabs(told - said) < 1e-5, "power known: a slope of %g", told);
    CHECK(fabs(several - said) < 1e-5, "two photographs: a slope of %g", several);
}
