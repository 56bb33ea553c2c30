/* Weights packed from halves are those that their floats are packed to. */
#include "tensor/conv/conv.h"
#include "tensor/cpu.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>

static void check_shape(int ic, int oc, int k, int constants)
{
    const ts_conv c = {.n = 1, .h = 8, .w = 8, .ic = ic, .oc = oc, .k = k, .dilation = 1, .constants = constants};
    const size_t count = (size_t)(ic * oc * k * k);
    unsigned char *half = malloc(2 * count + 1), *unaligned = half + 1;
    uint16_t *numbers = malloc(count * sizeof *numbers);
    float *full = malloc(count * sizeof *full);
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, (uint64_t)count);
    for (size_t i = 0; i < count; i++) numbers[i] = (uint16_t)(ts_rng_int(&rng, 0x7c00) | ts_rng_int(&rng, 2) << 15);
    memcpy(unaligned, numbers, 2 * count);
    ts_elementwise_k()->from_half((int64_t)count, numbers, full);
    for (int use = TS_CONV_FORWARD; use < TS_CONV_USES; use++) {
        const bool direct = use == TS_CONV_FORWARD || use == TS_CONV_DATA_GRADIENT || use == TS_CONV_FORWARD_BF16 ||
            use == TS_CONV_DATA_GRADIENT_BF16;
        const bool winograd = use == TS_CONV_WINOGRAD || use == TS_CONV_DATA_GRADIENT_WINOGRAD;
        if (!direct && k != 3 && (!winograd || k != 5)) continue;
        const size_t packed = ts_conv_packed_count(&c, (ts_conv_use)use);
        float *a = aligned_alloc(64, (packed + 15) / 16 * 64), *b = aligned_alloc(64, (packed + 15) / 16 * 64);
        memset(a, 1, packed * sizeof *a);
        memset(b, 2, packed * sizeof *b);
        ts_conv_pack(&c, (ts_conv_use)use, full, a);
        CHECK(ts_conv_pack_half(&c, (ts_conv_use)use, unaligned, b), "no memory");
        for (size_t i = 0; i < packed; i++)
            CHECK(memcmp(&a[i], &b[i], sizeof *a) == 0, "use %d, %d to %d channels, side %d: float %zu of %zu", use, ic,
                  oc, k, i, packed);
        free(a);
        free(b);
    }
    free(half);
    free(numbers);
    free(full);
}

TEST(conv_packs_halves)
{
    static const int channels[] = {1, 3, 9, 16, 17, 33, 64};
    const ts_isa before = ts_isa_now();
    for (int isa = 0; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        for (int i = 0; i < 7; i++)
            for (int o = 0; o < 7; o++)
                for (int k = 1; k <= 5; k += 2) check_shape(channels[i], channels[o], k, i == 3 ? 5 : 0);
        check_shape(7, 40, 9, 0);
        check_shape(3, 33, 13, 0); /* one input's taps are turned at once */
        check_shape(2, 5, 15, 1);
    }
    ts_isa_use(before);
}
