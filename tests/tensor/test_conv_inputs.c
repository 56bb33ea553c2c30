/* What a convolution reads beside x: constants in an array of their own, and a base to which it is added. */
#include "tensor/conv/conv.h"
#include "tensor/cpu.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 64 };

static float *values(size_t count, ts_rng *r)
{
    float *p = malloc(count * sizeof(float));
    CHECK(p, "no memory");
    for (size_t i = 0; i < count; i++) p[i] = r ? ts_rng_range(r, -1, 1) : NAN;
    return p;
}

/* Of pixels of all channels those from first on, count of them. */
static float *channels_of(const float *all, size_t pixels, int channels, int first, int count)
{
    float *p = values(pixels * (size_t)count, NULL);
    for (size_t i = 0; i < pixels; i++)
        memcpy(p + i * (size_t)count, all + i * (size_t)channels + first, sizeof(float) * (size_t)count);
    return p;
}

/* By the way that the tape would take. start: what y holds before, or NULL. */
static float *run(const ts_conv *c, const ts_conv_inputs *in, const float *weight, float leak, const float *start)
{
    const ts_conv_use use = ts_conv_packing(c, TS_CONV_OUTPUT);
    const size_t count = (size_t)c->n * (size_t)c->h * (size_t)c->w * (size_t)c->oc;
    float *packed = values(ts_conv_packed_count(c, use), NULL), *y = values(count + 2 * GUARD, NULL);
    ts_conv_inputs all = *in;
    if (start) {
        memcpy(y + GUARD, start, count * sizeof(float));
        all.base = y + GUARD;
    }
    ts_conv_pack(c, use, weight, packed);
    (use == TS_CONV_WINOGRAD            ? ts_conv_forward_winograd
         : use == TS_CONV_WINOGRAD_BF16 ? ts_conv_forward_winograd_bf16
         : use == TS_CONV_FORWARD_BF16  ? ts_conv_forward_bf16
                                        : ts_conv_forward)(c, &all, packed, leak, y + GUARD);
    for (size_t i = 0; i < GUARD; i++)
        CHECK(isnan(y[i]) && isnan(y[GUARD + count + i]), "written %zu floats outside the result", i);
    memmove(y, y + GUARD, count * sizeof(float));
    free(packed);
    return y;
}

static float *gradient(const ts_conv *c, const ts_conv_inputs *in, const float *dy)
{
    const size_t count = (size_t)(c->k * c->k * c->ic) * (size_t)c->oc;
    float *dweight = values(count + 2 * GUARD, NULL);
    memset(dweight + GUARD, 0, count * sizeof(float));
    (ts_conv_choose(c, TS_CONV_WEIGHTS) == TS_CONV_BY_AMX ? ts_conv_weight_gradient_bf16
         : ts_conv_rounds_weights(c)                      ? ts_conv_weight_gradient_winograd_bf16
                                     : ts_conv_weight_gradient_winograd)(c, in, dy, dweight + GUARD);
    for (size_t i = 0; i < GUARD; i++)
        CHECK(isnan(dweight[i]) && isnan(dweight[GUARD + count + i]), "written %zu floats outside the gradient", i);
    memmove(dweight, dweight + GUARD, count * sizeof(float));
    return dweight;
}

static const char *text(const ts_conv *c)
{
    static char line[160];
    snprintf(line, sizeof line, "%s, %s, %d x %d, %d (%d constants) to %d, side %d, dilation %d",
             ts_isa_name(ts_isa_now()), c->compute.precision == TS_BF16 ? "bf16" : "f32", c->h, c->w, c->ic,
             c->constants, c->oc, c->k, c->dilation);
    return line;
}

/* Returns whether the way takes constants and a base; then both must be as if they were not apart. */
static bool as_if_joined(const ts_conv *c, ts_rng *r)
{
    const size_t pixels = (size_t)c->n * (size_t)c->h * (size_t)c->w, outputs = pixels * (size_t)c->oc,
                 bytes = outputs * sizeof(float);
    if (!ts_conv_adds(c)) {
        CHECK(!ts_conv_joins(c, TS_CONV_OUTPUT), "%s: joins constants, adds no base", text(c));
        return false;
    }
    const int variables = ts_conv_variables(c);
    float *x = values(pixels * (size_t)c->ic, r), *weight = values((size_t)(c->k * c->k * c->ic) * (size_t)c->oc, r),
          *bias = values((size_t)c->oc, r), *base = values(outputs, r),
          *first = channels_of(x, pixels, c->ic, 0, variables),
          *rest = channels_of(x, pixels, c->ic, variables, c->constants);
    float *plain = run(c, &(ts_conv_inputs){.x = x, .bias = bias}, weight, 0.2f, NULL);
    if (ts_conv_joins(c, TS_CONV_OUTPUT) && c->constants) {
        float *y = run(c, &(ts_conv_inputs){.x = first, .bias = bias, .constants = rest}, weight, 0.2f, NULL);
        CHECK(!memcmp(y, plain, bytes), "%s: constants apart give other bytes", text(c));
        free(y);
    }
    if (ts_conv_joins(c, TS_CONV_WEIGHTS) && c->constants) {
        float *joined = gradient(c, &(ts_conv_inputs){.x = x}, base),
              *apart = gradient(c, &(ts_conv_inputs){.x = first, .constants = rest}, base);
        CHECK(!memcmp(joined, apart, sizeof(float) * (size_t)(c->k * c->k * c->ic) * (size_t)c->oc),
              "%s: constants apart give another gradient of weights", text(c));
        free(joined), free(apart);
    }
    free(plain);
    /* Without an activation a base is added to the sum: one rounding. */
    plain = run(c, &(ts_conv_inputs){.x = x, .bias = bias}, weight, 1, NULL);
    float *added = run(c, &(ts_conv_inputs){.x = x, .bias = bias, .base = base}, weight, 1, NULL),
          *in_place = run(c, &(ts_conv_inputs){.x = x, .bias = bias}, weight, 1, base),
          *bent = run(c, &(ts_conv_inputs){.x = x, .bias = bias, .base = base}, weight, 0.2f, NULL);
    for (size_t i = 0; i < outputs; i++) {
        const float sum = plain[i] + base[i];
        CHECK(added[i] == sum, "%s: value %zu is %.9g, not %.9g", text(c), i, added[i], sum);
        CHECK(bent[i] == (sum > 0 ? sum : 0.2f * sum), "%s: value %zu is %.9g of %.9g", text(c), i, bent[i], sum);
    }
    CHECK(!memcmp(in_place, added, bytes), "%s: a base in place gives other bytes", text(c));
    free(x), free(weight), free(bias), free(base), free(first), free(rest);
    free(plain), free(added), free(in_place), free(bent);
    return true;
}

TEST(conv_reads_constants_and_base_apart)
{
    static const ts_conv shapes[] = {
        {1, 24, 40, 17, 16, 3, 1, TS_PAD_REPLICATE, 5, {0}}, {1, 24, 40, 44, 32, 3, 1, TS_PAD_REPLICATE, 12, {0}},
        {2, 33, 31, 32, 20, 3, 2, TS_PAD_ZERO, 9, {0}},      {1, 32, 32, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
        {1, 24, 24, 24, 33, 5, 1, TS_PAD_REPLICATE, 7, {0}}, {3, 7, 5, 12, 8, 1, 1, TS_PAD_ZERO, 4, {0}},
    };
    ts_rng r = ts_rng_make(31, TS_STREAM_TEST, 0);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++)
        for (int i = 0, taken = 0; i < 2 * (int)(sizeof shapes / sizeof *shapes); i++) {
            ts_conv c = shapes[i / 2];
            c.compute.precision = i % 2 ? TS_BF16 : TS_F32;
            ts_isa_use((ts_isa)isa);
            taken += as_if_joined(&c, &r);
            CHECK(i + 2 < 2 * (int)(sizeof shapes / sizeof *shapes) || taken > 4, "%s: %d shapes were looked at",
                  ts_isa_name((ts_isa)isa), taken);
        }
    ts_isa_use(ts_isa_best());
}
