#include "bench/conv_ways.h"
#include "tensor/rng.h"
#include <stddef.h>
#include <stdlib.h>

static float *values(size_t count, float scale)
{
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, count);
    float *p = aligned_alloc(64, (count * sizeof(float) + 63) / 64 * 64);
    if (!p) abort();
    for (size_t i = 0; i < count; i++) p[i] = ts_rng_range(&r, -scale, scale);
    return p;
}

bench_conv bench_conv_make(ts_conv c)
{
    const bool winograd = c.k == 3 || c.k == 5;
    const size_t pixels = (size_t)c.n * (size_t)c.h * (size_t)c.w,
                 weights = (size_t)c.ic * (size_t)c.oc * (size_t)(c.k * c.k);
    bench_conv w = {c,
                    values(pixels * (size_t)c.ic, 1),
                    values(pixels * (size_t)c.oc, 1),
                    values(weights, 0.01f),
                    values((size_t)c.oc, 1),
                    values(ts_conv_packed_count(&c, TS_CONV_FORWARD), 1),
                    values(ts_conv_packed_count(&c, TS_CONV_DATA_GRADIENT), 1),
                    winograd ? values(ts_conv_packed_count(&c, TS_CONV_WINOGRAD), 1) : NULL,
                    winograd ? values(ts_conv_packed_count(&c, TS_CONV_DATA_GRADIENT_WINOGRAD), 1) : NULL,
                    values(ts_conv_packed_count(&c, TS_CONV_FORWARD_BF16), 1),
                    values(ts_conv_packed_count(&c, TS_CONV_DATA_GRADIENT_BF16), 1),
                    c.k == 3 ? values(ts_conv_packed_count(&c, TS_CONV_WINOGRAD_BF16), 1) : NULL,
                    c.k == 3 ? values(ts_conv_packed_count(&c, TS_CONV_DATA_GRADIENT_WINOGRAD_BF16), 1) : NULL};
    ts_conv_pack(&c, TS_CONV_FORWARD_BF16, w.weight, w.packed_bf16);
    ts_conv_pack(&c, TS_CONV_DATA_GRADIENT_BF16, w.weight, w.packed_gradient_bf16);
    ts_conv_pack(&c, TS_CONV_FORWARD, w.weight, w.packed);
    ts_conv_pack(&c, TS_CONV_DATA_GRADIENT, w.weight, w.packed_gradient);
    if (winograd) {
        ts_conv_pack(&c, TS_CONV_WINOGRAD, w.weight, w.packed_winograd);
        ts_conv_pack(&c, TS_CONV_DATA_GRADIENT_WINOGRAD, w.weight, w.packed_gradient_winograd);
    }
    if (c.k == 3) {
        ts_conv_pack(&c, TS_CONV_WINOGRAD_BF16, w.weight, w.packed_winograd_bf16);
        ts_conv_pack(&c, TS_CONV_DATA_GRADIENT_WINOGRAD_BF16, w.weight, w.packed_gradient_winograd_bf16);
    }
    return w;
}

void bench_conv_discard(bench_conv *w)
{
    free(w->x), free(w->y), free(w->weight), free(w->bias), free(w->packed), free(w->packed_gradient),
        free(w->packed_winograd), free(w->packed_gradient_winograd), free(w->packed_bf16);
    free(w->packed_gradient_bf16), free(w->packed_winograd_bf16), free(w->packed_gradient_winograd_bf16);
}

static void forward(void *user)
{
    bench_conv *w = user;
    ts_conv_forward(&w->c, &(ts_conv_inputs){.x = w->x, .bias = w->bias}, w->packed, 0.2f, w->y);
}

static void winograd(void *user)
{
    bench_conv *w = user;
    ts_conv_forward_winograd(&w->c, &(ts_conv_inputs){.x = w->x, .bias = w->bias}, w->packed_winograd, 0.2f, w->y);
}

static void data_gradient(void *user)
{
    bench_conv *w = user;
    ts_conv_data_gradient(&w->c, w->y, w->packed_gradient, w->x, false);
}

static void weight_gradient(void *user)
{
    bench_conv *w = user;
    ts_conv_weight_gradient(&w->c, w->x, w->y, w->weight, w->bias);
}

static void data_gradient_winograd(void *user)
{
    bench_conv *w = user;
    ts_conv_data_gradient_winograd(&w->c, w->y, w->packed_gradient_winograd, w->x, false);
}

static void weight_gradient_winograd(void *user)
{
    bench_conv *w = user;
    ts_conv_weight_gradient_winograd(&w->c, &(ts_conv_inputs){.x = w->x}, w->y, w->weight);
}

static void forward_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_forward_bf16(&w->c, &(ts_conv_inputs){.x = w->x, .bias = w->bias}, w->packed_bf16, 0.2f, w->y);
}

static void data_gradient_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_data_gradient_bf16(&w->c, w->y, w->packed_gradient_bf16, w->x, false);
}

static void weight_gradient_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_weight_gradient_bf16(&w->c, &(ts_conv_inputs){.x = w->x}, w->y, w->weight);
}

static void winograd_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_forward_winograd_bf16(&w->c, &(ts_conv_inputs){.x = w->x, .bias = w->bias}, w->packed_winograd_bf16, 0.2f,
                                  w->y);
}

static void data_gradient_winograd_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_data_gradient_winograd_bf16(&w->c, w->y, w->packed_gradient_winograd_bf16, w->x, false);
}

static void weight_gradient_winograd_bf16(void *user)
{
    bench_conv *w = user;
    ts_conv_weight_gradient_winograd_bf16(&w->c, &(ts_conv_inputs){.x = w->x}, w->y, w->weight);
}

static void forward_naive(void *user)
{
    bench_conv *w = user;
    ts_conv_forward_naive(&w->c, &(ts_conv_inputs){.x = w->x, .bias = w->bias}, w->weight, 0.2f, w->y);
}

const bench_way bench_ways[] = {
    [BENCH_FORWARD] = {"forward", forward, BENCH_OUTPUT, false, offsetof(bench_conv, packed), TS_CONV_FORWARD},
    [BENCH_WINOGRAD] = {"Winograd forward", winograd, BENCH_OUTPUT, false, offsetof(bench_conv, packed_winograd),
                        TS_CONV_WINOGRAD},
    [BENCH_FORWARD_BF16] = {"bf16 forward", forward_bf16, BENCH_OUTPUT, true, offsetof(bench_conv, packed_bf16),
                            TS_CONV_FORWARD_BF16},
    [BENCH_WINOGRAD_BF16] = {"bf16 Winograd forward", winograd_bf16, BENCH_OUTPUT, true,
                             offsetof(bench_conv, packed_winograd_bf16), TS_CONV_WINOGRAD_BF16},
    [BENCH_DATA] = {"data gradient", data_gradient, BENCH_INPUT, false, offsetof(bench_conv, packed_gradient),
                    TS_CONV_DATA_GRADIENT},
    [BENCH_DATA_WINOGRAD] = {"Winograd data gradient", data_gradient_winograd, BENCH_INPUT, false,
                             offsetof(bench_conv, packed_gradient_winograd), TS_CONV_DATA_GRADIENT_WINOGRAD},
    [BENCH_DATA_BF16] = {"bf16 data gradient", data_gradient_bf16, BENCH_INPUT, true,
                         offsetof(bench_conv, packed_gradient_bf16), TS_CONV_DATA_GRADIENT_BF16},
    [BENCH_DATA_WINOGRAD_BF16] = {"bf16 Winograd data gradient", data_gradient_winograd_bf16, BENCH_INPUT, true,
                                  offsetof(bench_conv, packed_gradient_winograd_bf16),
                                  TS_CONV_DATA_GRADIENT_WINOGRAD_BF16},
    [BENCH_WEIGHTS] = {"weight gradient", weight_gradient, BENCH_KERNEL, false, 0, TS_CONV_FORWARD},
    [BENCH_WEIGHTS_WINOGRAD] = {"Winograd weight gradient", weight_gradient_winograd, BENCH_KERNEL, false, 0,
                                TS_CONV_FORWARD},
    [BENCH_WEIGHTS_BF16] = {"bf16 weight gradient", weight_gradient_bf16, BENCH_KERNEL, true, 0, TS_CONV_FORWARD},
    [BENCH_WEIGHTS_WINOGRAD_BF16] = {"bf16 Winograd weight gradient", weight_gradient_winograd_bf16, BENCH_KERNEL, true,
                                     0, TS_CONV_FORWARD},
    [BENCH_NAIVE] = {"naive forward", forward_naive, BENCH_OUTPUT, false, offsetof(bench_conv, packed),
                     TS_CONV_FORWARD},
};

bench_arrays bench_conv_arrays(const bench_conv *w, const bench_way *by)
{
    const int64_t pixels = (int64_t)w->c.n * w->c.h * w->c.w, in = pixels * w->c.ic, out = pixels * w->c.oc,
                  variables = pixels * ts_conv_variables(&w->c);
    if (by->makes == BENCH_KERNEL)
        return (bench_arrays){{w->x, w->y}, w->weight, {in, out}, (int64_t)w->c.ic * w->c.oc * w->c.k * w->c.k, true};
    const float *packed = *(float *const *)((const char *)w + by->packed);
    const int64_t kernel = (int64_t)ts_conv_packed_count(&w->c, by->use);
    if (by->makes == BENCH_INPUT) return (bench_arrays){{w->y, packed}, w->x, {out, kernel}, variables, false};
    return (bench_arrays){{w->x, packed}, w->y, {in, kernel}, out, false};
}
