/* Laws of the choice of a way; test_conv.c and the others hold each way against the loops. */
#include "tensor/conv/conv.h"
#include "tensor/cpu.h"
#include "tensor/rng.h"
#include "tests/test.h"

static ts_conv random_shape(ts_rng *r)
{
    static const int channels[] = {1, 3, 9, 16, 24, 64, 130}, sides[] = {1, 2, 4, 8, 16, 33, 64};
    return (ts_conv){1 + ts_rng_int(r, 9),
                     sides[ts_rng_int(r, 7)],
                     sides[ts_rng_int(r, 7)],
                     channels[ts_rng_int(r, 7)],
                     channels[ts_rng_int(r, 7)],
                     1 + 2 * ts_rng_int(r, 3),
                     1 + ts_rng_int(r, 2),
                     ts_rng_int(r, 2) ? TS_PAD_ZERO : TS_PAD_REPLICATE,
                     0,
                     {.exact = ts_rng_int(r, 2), .precision = ts_rng_int(r, 2) ? TS_BF16 : TS_F32}};
}

TEST(conv_choice_keeps_its_laws)
{
    int taken[TS_CONV_BY_AMX + 1] = {0};
    ts_rng r = ts_rng_make(31, TS_STREAM_TEST, 0);
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 4000; i++) {
            const ts_conv c = random_shape(&r);
            const ts_conv_direction direction = (ts_conv_direction)ts_rng_int(&r, 3);
            const ts_conv_way way = ts_conv_choose(&c, direction);
            const bool bf16 = c.compute.precision == TS_BF16, winograd = way == TS_CONV_BY_WINOGRAD;
            ts_conv more_threads = c;
            more_threads.compute.threads = 1 + ts_rng_int(&r, 8);
            taken[way]++;
            CHECK(ts_conv_choose(&more_threads, direction) == way, "%s, but not for another number of threads",
                  ts_conv_way_name(way));
            CHECK(!winograd || (!c.compute.exact && (c.k == 3 || (c.k == 5 && direction != TS_CONV_WEIGHTS && !bf16))),
                  "Winograd's way, exact or of side %d", c.k);
            CHECK(way != TS_CONV_BY_AMX || bf16, "the matrix unit multiplies f32");
            if (direction == TS_CONV_WEIGHTS) continue;
            CHECK(way == TS_CONV_BY_AMX || (c.k == 1) == (way == TS_CONV_POINTWISE), "%s of side %d",
                  ts_conv_way_name(way), c.k);
            const ts_conv_use use = ts_conv_packing(&c, direction);
            const bool winograd_bf16 = use == TS_CONV_WINOGRAD_BF16 || use == TS_CONV_DATA_GRADIENT_WINOGRAD_BF16;
            const bool few = c.k == 1 && (c.ic < 16 || c.oc < 16) && way != TS_CONV_BY_AMX;
            CHECK(winograd == (use == TS_CONV_WINOGRAD || use == TS_CONV_DATA_GRADIENT_WINOGRAD || winograd_bf16) &&
                      (bf16 && !few) ==
                          (use == TS_CONV_FORWARD_BF16 || use == TS_CONV_DATA_GRADIENT_BF16 || winograd_bf16),
                  "%s, but packed for use %d", ts_conv_way_name(way), (int)use);
        }
    }
    for (int way = 0; way < TS_CONV_BY_AMX; way++)
        CHECK(taken[way] > 0, "%s is never taken", ts_conv_way_name((ts_conv_way)way));
}
