/* Resampling: laws, and the same bytes for any number of threads. */
#include "tensor/resize.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

static ts_rng r;

static ts_tensor image(ts_arena *arena, int n, int h, int w, int c) { return ts_new(arena, (ts_shape){n, h, w, c}); }

TEST(resize_laws)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    CHECK(arena, "%s", st.message);
    r = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (int t = 0; t < 40; t++) {
        ts_tensor x = image(arena, 2, 1 + ts_rng_int(&r, 20), 1 + ts_rng_int(&r, 20), 1 + ts_rng_int(&r, 5));
        ts_tensor y = image(arena, 2, t % 4 ? 1 + ts_rng_int(&r, 20) : x.shape.h,
                            t % 4 ? 1 + ts_rng_int(&r, 20) : x.shape.w, x.shape.c);
        /* a constant stays one, values stay within the image's range */
        for (int64_t i = 0; i < ts_count(x.shape); i++) x.data[i] = t % 3 ? ts_rng_range(&r, 2, 5) : 0.7f;
        CHECK(ts_resize(&y, &x, arena, 0, &st) == TS_OK, "%s", st.message);
        for (int64_t i = 0; i < ts_count(y.shape); i++) {
            if (t % 3 == 0) CHECK(fabsf(y.data[i] - 0.7f) < 1e-6f, "a constant image changed: %g", (double)y.data[i]);
            else
                CHECK(y.data[i] >= 2 - 1e-5f && y.data[i] < 5 + 1e-5f, "%g is outside of the image's range",
                      (double)y.data[i]);
        }
        if (t % 4 == 0)
            CHECK(memcmp(x.data, y.data, (size_t)ts_count(x.shape) * sizeof(float)) == 0,
                  "the same size changed the image");
    }
    /* A ramp along x, away from the edges, stays the ramp: exactly when growing, up to the sampling of the triangle
     * when shrinking. */
    for (int w = 5; w < 200; w += 23) {
        ts_tensor x = image(arena, 1, 3, 64, 2), y = image(arena, 1, 5, w, 2);
        for (int64_t i = 0; i < ts_count(x.shape); i++) x.data[i] = (float)(i / 2 % 64);
        CHECK(ts_resize(&y, &x, arena, 0, &st) == TS_OK, "%s", st.message);
        const double step = 64.0 / w, margin = step > 1 ? step : 1;
        for (int j = 0; j < w; j++) {
            const double want = (j + 0.5) * step - 0.5;
            if (want < margin || want > 63 - margin) continue;
            CHECK(fabs(y.data[(w + j) * 2] - want) <= (step > 1 ? 0.1 * step : 1e-4),
                  "ramp to %d: pixel %d is %g, not %g", w, j, (double)y.data[(w + j) * 2], want);
        }
    }
    /* Halving averages with the triangle's weights 1 3 3 1 over 8. */
    ts_tensor x = image(arena, 1, 1, 8, 1), y = image(arena, 1, 1, 4, 1), wrong = image(arena, 1, 1, 4, 2);
    for (int i = 0; i < 8; i++) x.data[i] = (float)(i * i);
    CHECK(ts_resize(&y, &x, arena, 0, &st) == TS_OK, "%s", st.message);
    CHECK(fabsf(y.data[1] - (1 * 1 + 3 * 4 + 3 * 9 + 1 * 16) / 8.0f) < 1e-5f, "half: %g", (double)y.data[1]);
    CHECK(ts_resize(&wrong, &x, arena, 0, &st) == TS_INVALID && strstr(st.message, "channels"),
          "channels may not change: %s", st.message);
    ts_arena_destroy(&arena);
}

TEST(resize_any_threads)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    ts_tensor x = image(arena, 2, 61, 47, 3), y = image(arena, 2, 20, 90, 3), first = image(arena, 2, 20, 90, 3);
    r = ts_rng_make(4, TS_STREAM_TEST, 0);
    for (int64_t i = 0; i < ts_count(x.shape); i++) x.data[i] = ts_rng_uniform(&r);
    const int counts[] = {1, 2, 3, 7};
    for (int t = 0; t < 4; t++) {
        ts_threads_set(counts[t]);
        CHECK(ts_resize(t ? &y : &first, &x, arena, 0, &st) == TS_OK, "%s", st.message);
        CHECK(t == 0 || memcmp(y.data, first.data, (size_t)ts_count(y.shape) * sizeof(float)) == 0,
              "%d threads give other bytes", counts[t]);
    }
    ts_arena_destroy(&arena);
}
