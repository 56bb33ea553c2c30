/* Packed weights that are kept, and those for one use. */
#include "ops.h"
#include "tensor/conv/conv.h"
#include "tests/test.h"
#include <string.h>

enum { LAYERS = 6, CHANNELS = 64, SIDE = 8, VALUES = CHANNELS * CHANNELS * 9, PIXELS = SIDE * SIDE * CHANNELS };
static float weight[LAYERS][VALUES], image[PIXELS], kept[PIXELS];

static void fill(float *to, int count, uint64_t seed)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (int i = 0; i < count; i++) to[i] = ts_rng_range(&r, -0.1f, 0.1f);
}

/* A layer's weights for one use have the memory that the last one's had; the results are the same bytes. */
TEST(tape_passed_weights_are_not_kept)
{
    ts_status st = {0};
    ag_tape *tape = ag_tape_create(false, &st);
    CHECK(tape, "%s", st.message);
    fill(image, PIXELS, 9);
    for (int i = 0; i < LAYERS; i++) fill(weight[i], VALUES, (uint64_t)i);
    ag_freeze(tape, true);
    for (int passing = 1; passing >= 0; passing--) {
        ag_reset(tape);
        ag_pass(tape, passing);
        ag_value *x = ag_constant(tape, ts_view(image, (ts_shape){1, SIDE, SIDE, CHANNELS}));
        for (int i = 0; i < LAYERS; i++)
            x = ag_conv(tape, x, ag_constant(tape, ts_view(weight[i], (ts_shape){CHANNELS, CHANNELS, 3, 3})), NULL, 1,
                        TS_PAD_ZERO, 0.2f);
        CHECK(x, "%s", ag_status(tape)->message);
        const size_t held = ts_arena_peak(ag_arena(tape));
        if (passing) {
            memcpy(kept, x->t.data, sizeof kept);
            CHECK(held < 3 * sizeof weight[0], "%zu bytes at once: the weights of several layers", held);
        } else {
            CHECK(memcmp(kept, x->t.data, sizeof kept) == 0, "other results");
        }
    }
    const ts_conv c = {1, SIDE, SIDE, CHANNELS, CHANNELS, 3, 1, TS_PAD_ZERO, 0, {0}};
    for (int passing = 0; passing < 2; passing++) {
        ag_pass(tape, passing);
        const float *first = ag_packed(tape, &c, TS_CONV_FORWARD, weight[0]),
                    *second = ag_packed(tape, &c, TS_CONV_FORWARD, weight[0]);
        CHECK((first == second) == !passing, "%s", passing ? "kept" : "packed again");
    }
    ag_tape_destroy(&tape);
}
