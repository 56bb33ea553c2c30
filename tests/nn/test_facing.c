/* Normals face the camera that sees them. */
#include "nn/facing.h"
#include "nn/first_guess.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 96, PIXELS = SIDE * SIDE, C = MAP_CHANNELS };
static float maps[PIXELS * C], before[PIXELS * C];

static void draw(float longest)
{
    ts_rng rng = ts_rng_make(8, 0, 0);
    for (int i = 0; i < PIXELS * C; i++) maps[i] = ts_rng_range(&rng, -1, 1);
    for (int i = 0; i < PIXELS; i++) {
        const float turn = ts_rng_range(&rng, 0, 6.2831853f), length = longest * ts_rng_uniform(&rng);
        maps[i * C + MAP_NORMAL] = length * cosf(turn), maps[i * C + MAP_NORMAL + 1] = length * sinf(turn);
    }
    memcpy(before, maps, sizeof maps);
}

/* The pixel's normal, and the direction to the camera. */
static void at(const float *of, int i, const float camera[3], double n[3], double v[3])
{
    const double place[3] = {(i % SIDE + 0.5) / SIDE - 0.5, 0.5 - (i / SIDE + 0.5) / SIDE, 0};
    double square = 0;
    for (int k = 0; k < 2; k++) n[k] = (double)of[i * C + MAP_NORMAL + k];
    const double across = n[0] * n[0] + n[1] * n[1];
    for (int k = 0; k < 2 && across > 1; k++) n[k] /= sqrt(across);
    n[2] = sqrt(fmax(1 - across, 0));
    for (int k = 0; k < 3; k++) v[k] = (double)camera[k] - place[k], square += v[k] * v[k];
    for (int k = 0; k < 3; k++) v[k] /= sqrt(square);
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static const float cameras[][3] = {{0, 0, 0.8f}, {0.2f, -0.1f, 2}, {0, -0.9f, 0.9f}, {0, -2, 0.3f}};

/* Drawn normals, some longer than 1 in x and y; of those that are about 1 long z is known to 5e-4 in floats. */
TEST(facing_normals_stay_and_others_are_turned_as_far_as_they_must)
{
    for (size_t c = 0; c < sizeof cameras / sizeof *cameras; c++) {
        int turned = 0;
        draw(1.2f);
        nn_face_camera(rd_grid_on(rd_grid_full(SIDE), 1), cameras[c], C, maps);
        for (int i = 0; i < PIXELS; i++) {
            double was[3], is[3], v[3], moved = 0;
            at(before, i, cameras[c], was, v);
            at(maps, i, cameras[c], is, v);
            const double least = fmin((double)NN_FACING, v[2]), now = hypot(is[0], is[1]);
            for (int k = 0; k < 2; k++) moved = fmax(moved, fabs(is[k] - was[k]));
            CHECK(now < 1 + 1e-6, "x and y are %g long", now);
            if (moved < 1e-6) {
                CHECK(dot(was, v) > least - 1e-6, "a cosine of %g stays", dot(was, v));
                continue;
            }
            turned++;
            const double triple = is[0] * (was[1] * v[2] - was[2] * v[1]) + is[1] * (was[2] * v[0] - was[0] * v[2]) +
                is[2] * (was[0] * v[1] - was[1] * v[0]);
            CHECK(dot(was, v) < least + 5e-4 && fabs(dot(is, v) - least) < 5e-4, "from a cosine of %g to %g",
                  dot(was, v), dot(is, v));
            CHECK(fabs(triple) < 1e-3 && dot(is, was) > dot(was, v), "turned beside the plane of both");
        }
        CHECK(turned > 20 && turned < PIXELS * 2 / 3, "camera %zu: %d normals turned", c, turned);
    }
}

/* However flat the camera's view is. */
TEST(facing_leaves_a_flat_sample_flat)
{
    const float grazing[3] = {0, -0.97f, 0.05f};
    draw(0);
    nn_face_camera(rd_grid_on(rd_grid_full(SIDE), 1), grazing, C, maps);
    CHECK(memcmp(maps, before, sizeof maps) == 0, "a flat sample is bent");
}

TEST(facing_changes_normals_alone_and_the_same_on_threads)
{
    static float one[PIXELS * C];
    draw(1);
    nn_face_camera(rd_grid_on(rd_grid_full(SIDE), 1), cameras[2], C, maps);
    for (int i = 0; i < PIXELS * C; i++)
        if (i % C != MAP_NORMAL && i % C != MAP_NORMAL + 1) CHECK(maps[i] == before[i], "channel %d moved", i % C);
    memcpy(one, maps, sizeof one);
    memcpy(maps, before, sizeof maps);
    nn_face_camera(rd_grid_on(rd_grid_full(SIDE), 3), cameras[2], C, maps);
    CHECK(memcmp(one, maps, sizeof one) == 0, "three threads make other normals than one");
}

/* A network that said normals nearly in the sample's plane, which its relief makes steeper still. */
TEST(facing_is_what_the_steps_begin_with)
{
    static float image[PIXELS * 3], spread[PIXELS * NN_SPREADS], deviation[PIXELS * NN_SPREADS];
    const float scene[2 * RD_SCENE_NUMBERS] = {0};
    const nn_taken taken = {.view = rd_flash(), .known = NN_KNOWN_CAMERA | NN_KNOWN_LIGHT, .photographs = 1};
    ts_status st = {0};
    for (int i = 0; i < PIXELS * C; i++) maps[i] = i % C == MAP_NORMAL ? 0.9f : i % C == MAP_NORMAL + 1 ? 0 : -0.4f;
    for (int i = 0; i < PIXELS * 3; i++) image[i] = 0.3f;
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) spread[i] = -1;
    nn_first_guess guess = {.r0 = maps, .spread = spread, .deviation = deviation};
    ts_arena *arena = ts_arena_create(0, &st);
    CHECK(arena && nn_first_guess_settle(rd_grid_full(SIDE), C, image, scene, &taken, arena, &guess, &st) == TS_OK,
          "%s", st.message);
    ts_arena_destroy(&arena);
    for (int i = 0; i < PIXELS; i++) {
        double n[3], v[3];
        at(maps, i, guess.view.camera, n, v);
        CHECK(dot(n, v) > (double)NN_FACING - 1e-4, "pixel %d faces away: a cosine of %g", i, dot(n, v));
    }
}
