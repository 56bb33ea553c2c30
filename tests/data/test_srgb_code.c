/* The 8-bit codes of sRGB: those of the power, at every threshold and between. */
#include "data/image/image.h"
#include "data/image/srgb_code.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>

static unsigned by_power(float v) { return (unsigned)(io_linear_to_srgb(v) * 255 + 0.5f); }

TEST(srgb_codes_are_those_of_the_power)
{
    const io_srgb_codes *c = io_srgb_codes_made();
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (unsigned k = 1; k < 256; k++) {
        const float at = c->threshold[k], below = nextafterf(at, 0);
        CHECK(io_srgb_code(c, at) == k && by_power(at) == k, "%g has the code %u", (double)at, io_srgb_code(c, at));
        CHECK(io_srgb_code(c, below) == k - 1 && by_power(below) == k - 1, "%g has the code %u", (double)below,
              io_srgb_code(c, below));
        CHECK(io_srgb_code(c, c->linear[k]) == k, "code %u does not come back", k);
    }
    for (int i = 0; i < 200000; i++) {
        const float v = ts_rng_uniform(&rng) * (i % 2 ? 1 : 0.01f);
        CHECK(io_srgb_code(c, v) == by_power(v), "%g has the code %u", (double)v, io_srgb_code(c, v));
    }
    CHECK(io_srgb_code(c, 0) == 0 && io_srgb_code(c, 1) == 255, "black and white");
}
