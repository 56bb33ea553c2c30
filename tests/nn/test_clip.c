/* Photographs as the method has them: in [0, 1], at g's size. */
#include "nn/clip.h"
#include "tensor/resize.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 61, SIZE = 24, VALUES = SIDE * SIDE * 3 };
static float photographs[2][VALUES], clipped[VALUES], small[2 * VALUES], expected[VALUES];

/* The second has values that no clipped photograph has. */
static void make(void)
{
    ts_rng rng = ts_rng_make(12, 0, 0);
    for (int i = 0; i < VALUES; i++) photographs[0][i] = ts_rng_uniform(&rng);
    for (int i = 0; i < VALUES; i++) photographs[1][i] = ts_rng_range(&rng, -1, 3);
    photographs[1][7] = NAN, photographs[1][100] = INFINITY, photographs[1][1000] = -INFINITY;
}

static void check(int size, int threads)
{
    const float *const image[2] = {photographs[0], photographs[1]};
    const int values = size * size * 3;
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    const ts_tensor to = ts_view(small, (ts_shape){2, size, size, 3});
    CHECK(arena && nn_clip_to(image, SIDE, &to, arena, threads, &st) == TS_OK, "%s", st.message);
    for (int k = 0; k < 2; k++) {
        ts_tensor whole = ts_view(clipped, (ts_shape){1, SIDE, SIDE, 3}),
                  want = ts_view(expected, (ts_shape){1, size, size, 3});
        nn_clip(VALUES, photographs[k], clipped);
        if (size == SIDE) memcpy(expected, clipped, sizeof clipped);
        else CHECK(ts_resize(&want, &whole, arena, 1, &st) == TS_OK, "%s", st.message);
        CHECK(memcmp(small + (size_t)k * (size_t)values, expected, (size_t)values * sizeof *small) == 0,
              "photograph %d at %d pixels, %d threads, is another", k, size, threads);
    }
    ts_arena_destroy(&arena);
}

TEST(clip_to_a_size_is_to_clip_and_then_to_resample)
{
    make();
    CHECK(nn_clipped(VALUES, photographs[0], 1) && !nn_clipped(VALUES, photographs[1], 1), "which one is clipped");
    for (int threads = 1; threads <= 3; threads += 2) {
        check(SIZE, threads);
        check(SIDE, threads);
    }
}
