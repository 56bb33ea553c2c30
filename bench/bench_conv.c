/* Convolutions and their gradients: sizes of the published networks at 256 x 256, and of a small model in training. */
#include "bench/arrays.h"
#include "bench/bench.h"
#include "tensor/conv/conv.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct work {
    ts_conv c;
    float *x, *y, *weight, *bias, *packed, *packed_gradient, *packed_winograd, *packed_gradient_winograd, *packed_bf16,
        *packed_gradient_bf16, *packed_winograd_bf16, *packed_gradient_winograd_bf16;
} work;

static float *values(size_t count, float scale)
{
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, count);
    float *p = aligned_alloc(64, (count * sizeof(float) + 63) / 64 * 64);
    if (!p) abort();
    for (size_t i = 0; i < count; i++) p[i] = ts_rng_range(&r, -scale, scale);
    return p;
}

static work make(ts_conv c)
{
    const bool winograd = c.k == 3 || c.k == 5;
    const size_t pixels = (size_t)c.n * (size_t)c.h * (size_t)c.w,
                 weights = (size_t)c.ic * (size_t)c.oc * (size_t)(c.k * c.k);
    work w = {c,
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

static void discard(work *w)
{
    free(w->x), free(w->y), free(w->weight), free(w->bias), free(w->packed), free(w->packed_gradient),
        free(w->packed_winograd), free(w->packed_gradient_winograd), free(w->packed_bf16);
    free(w->packed_gradient_bf16), free(w->packed_winograd_bf16), free(w->packed_gradient_winograd_bf16);
}

static void forward(void *user)
{
    work *w = user;
    ts_conv_forward(&w->c, w->x, w->packed, w->bias, 0.2f, w->y);
}

static void winograd(void *user)
{
    work *w = user;
    ts_conv_forward_winograd(&w->c, w->x, w->packed_winograd, w->bias, 0.2f, w->y);
}

static void data_gradient(void *user)
{
    work *w = user;
    ts_conv_data_gradient(&w->c, w->y, w->packed_gradient, w->x, false);
}

static void weight_gradient(void *user)
{
    work *w = user;
    ts_conv_weight_gradient(&w->c, w->x, w->y, w->weight, w->bias);
}

static void data_gradient_winograd(void *user)
{
    work *w = user;
    ts_conv_data_gradient_winograd(&w->c, w->y, w->packed_gradient_winograd, w->x, false);
}

static void weight_gradient_winograd(void *user)
{
    work *w = user;
    ts_conv_weight_gradient_winograd(&w->c, w->x, w->y, w->weight);
}

static void forward_bf16(void *user)
{
    work *w = user;
    ts_conv_forward_bf16(&w->c, w->x, w->packed_bf16, w->bias, 0.2f, w->y);
}

static void data_gradient_bf16(void *user)
{
    work *w = user;
    ts_conv_data_gradient_bf16(&w->c, w->y, w->packed_gradient_bf16, w->x, false);
}

static void weight_gradient_bf16(void *user)
{
    work *w = user;
    ts_conv_weight_gradient_bf16(&w->c, w->x, w->y, w->weight);
}

static void winograd_bf16(void *user)
{
    work *w = user;
    ts_conv_forward_winograd_bf16(&w->c, w->x, w->packed_winograd_bf16, w->bias, 0.2f, w->y);
}

static void data_gradient_winograd_bf16(void *user)
{
    work *w = user;
    ts_conv_data_gradient_winograd_bf16(&w->c, w->y, w->packed_gradient_winograd_bf16, w->x, false);
}

static void weight_gradient_winograd_bf16(void *user)
{
    work *w = user;
    ts_conv_weight_gradient_winograd_bf16(&w->c, w->x, w->y, w->weight);
}

static void forward_naive(void *user)
{
    work *w = user;
    ts_conv_forward_naive(&w->c, w->x, w->weight, w->bias, 0.2f, w->y);
}

/* What a computation reads and writes, and which of its packed weights. */
typedef struct way {
    void (*f)(void *user);
    enum { FORWARD, BACK, WEIGHTS } direction;
    bool bf16;
    size_t packed; /* its offset in work; WEIGHTS has none */
    ts_conv_use use;
} way;

static const way ways[] = {
    {forward, FORWARD, false, offsetof(work, packed), TS_CONV_FORWARD},
    {winograd, FORWARD, false, offsetof(work, packed_winograd), TS_CONV_WINOGRAD},
    {forward_bf16, FORWARD, true, offsetof(work, packed_bf16), TS_CONV_FORWARD_BF16},
    {winograd_bf16, FORWARD, true, offsetof(work, packed_winograd_bf16), TS_CONV_WINOGRAD_BF16},
    {data_gradient, BACK, false, offsetof(work, packed_gradient), TS_CONV_DATA_GRADIENT},
    {data_gradient_winograd, BACK, false, offsetof(work, packed_gradient_winograd), TS_CONV_DATA_GRADIENT_WINOGRAD},
    {data_gradient_bf16, BACK, true, offsetof(work, packed_gradient_bf16), TS_CONV_DATA_GRADIENT_BF16},
    {data_gradient_winograd_bf16, BACK, true, offsetof(work, packed_gradient_winograd_bf16),
     TS_CONV_DATA_GRADIENT_WINOGRAD_BF16},
    {weight_gradient, WEIGHTS, false, 0, TS_CONV_FORWARD},
    {weight_gradient_winograd, WEIGHTS, false, 0, TS_CONV_FORWARD},
    {weight_gradient_bf16, WEIGHTS, true, 0, TS_CONV_FORWARD},
    {weight_gradient_winograd_bf16, WEIGHTS, true, 0, TS_CONV_FORWARD},
};

static const way *way_of(void (*f)(void *user))
{
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        if (ways[i].f == f) return &ways[i];
    return NULL;
}

static bench_arrays arrays_of(const work *w, const way *by)
{
    const int64_t pixels = (int64_t)w->c.n * w->c.h * w->c.w, in = pixels * w->c.ic, out = pixels * w->c.oc;
    if (by->direction == WEIGHTS)
        return (bench_arrays){{w->x, w->y}, w->weight, {in, out}, (int64_t)w->c.ic * w->c.oc * w->c.k * w->c.k, true};
    const float *packed = *(float *const *)((const char *)w + by->packed);
    const int64_t kernel = (int64_t)ts_conv_packed_count(&w->c, by->use);
    if (by->direction == BACK) return (bench_arrays){{w->y, packed}, w->x, {out, kernel}, in, false};
    return (bench_arrays){{w->x, packed}, w->y, {in, kernel}, out, false};
}

static void row(const char *what, ts_conv c, void (*f)(void *user))
{
    char label[96];
    const way *by = way_of(f);
    snprintf(label, sizeof label, "%s n%d %dx%d %d->%d %dx%d%s%s", what, c.n, c.h, c.w, c.ic, c.oc, c.k, c.k,
             c.dilation > 1 ? " d2" : "", c.pad == TS_PAD_REPLICATE ? " rep" : "");
    const bool back = by && by->direction == BACK;
    if (back && c.constants)
        snprintf(label + strlen(label), sizeof label - strlen(label), " (of %d)", ts_conv_variables(&c));
    work w = make(c);
    bench_time t = bench_measure(f, &w);
    if (by && by->bf16 && !bench_bf16(&t)) snprintf(label + strlen(label), sizeof label - strlen(label), ", emulated");
    bench_row(label, t, 2.0 * c.n * c.h * c.w * (back ? ts_conv_variables(&c) : c.ic) * c.oc * c.k * c.k);
    if (by) {
        bench_arrays arrays = arrays_of(&w, by);
        bench_row_arrays(t, &arrays);
    }
    discard(&w);
}

static void peer_row(const char *what, const char *job, ts_conv c, void (*f)(void *user), double times)
{
    char label[96], text[128];
    snprintf(label, sizeof label, "%s n%d %dx%d %d->%d %dx%d%s", what, c.n, c.h, c.w, c.ic, c.oc, c.k, c.k,
             c.dilation > 1 ? " d2" : "");
    snprintf(text, sizeof text, "%s %d %d %d %d %d %d %d %s", job, c.n, c.h, c.w, c.ic, c.oc, c.k, c.dilation,
             c.pad == TS_PAD_ZERO ? "zero" : "replicate");
    work w = make(c);
    const double flop = times * 2.0 * c.n * c.h * c.w * c.ic * c.oc * c.k * c.k;
    const bench_time t = bench_measure(f, &w);
    bench_row(label, t, flop);
    bench_row_peers(t, flop, text);
    discard(&w);
}

static void both_gradients(void *user)
{
    data_gradient(user);
    weight_gradient(user);
}

static const ts_conv published[] = {
    {1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},       {1, 256, 256, 20, 256, 5, 1, TS_PAD_REPLICATE, 10, {0}},
    {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}}, {1, 256, 256, 256, 192, 1, 1, TS_PAD_REPLICATE, 0, {0}},
    {1, 256, 256, 64, 192, 1, 1, TS_PAD_REPLICATE, 0, {0}}, {1, 256, 256, 64, 10, 3, 1, TS_PAD_REPLICATE, 0, {0}},
    {1, 64, 64, 512, 512, 5, 1, TS_PAD_ZERO, 0, {0}},       {1, 8, 8, 512, 512, 3, 1, TS_PAD_ZERO, 0, {0}},
    {1, 4, 4, 512, 512, 5, 1, TS_PAD_ZERO, 0, {0}},
};

/* h of the shipped model's coarse steps. */
static const ts_conv refiner[] = {
    {8, 64, 64, 18, 128, 5, 1, TS_PAD_REPLICATE, 9, {0}}, {8, 64, 64, 128, 192, 1, 1, TS_PAD_REPLICATE, 0, {0}},
    {8, 64, 64, 64, 192, 1, 1, TS_PAD_REPLICATE, 0, {0}}, {8, 64, 64, 64, 128, 3, 2, TS_PAD_REPLICATE, 0, {0}},
    {8, 64, 64, 64, 9, 3, 1, TS_PAD_REPLICATE, 0, {0}},
};

/* Its g, some layers of each size; and larger kernels. */
static const ts_conv unet[] = {
    {8, 64, 64, 3, 24, 3, 1, TS_PAD_ZERO, 0, {0}},  {8, 32, 32, 24, 48, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 16, 16, 96, 96, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 8, 8, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 4, 4, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 2, 2, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 8, 8, 384, 192, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 16, 16, 192, 96, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 32, 32, 96, 48, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 64, 64, 48, 24, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 64, 64, 24, 24, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 64, 64, 24, 9, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 8, 8, 64, 128, 5, 1, TS_PAD_ZERO, 0, {0}},  {8, 16, 16, 128, 64, 5, 1, TS_PAD_ZERO, 0, {0}},
};

static void all(const ts_conv *shape, size_t count)
{
    for (size_t i = 0; i < count; i++) row("forward", shape[i], forward);
    for (size_t i = 0; i < count; i++) row("data gradient", shape[i], data_gradient);
    for (size_t i = 0; i < count; i++) row("weight gradient", shape[i], weight_gradient);
}

BENCH(conv_published)
{
    bench_heading("Convolutions of the published networks");
    all(published, sizeof published / sizeof *published);
}

BENCH(conv_refiner)
{
    bench_heading("Convolutions of a coarse step in training");
    all(refiner, sizeof refiner / sizeof *refiner);
}

BENCH(conv_unet)
{
    bench_heading(
        "Convolutions of g in training (small images: zero padding is skipped, so more than the peak is possible)");
    all(unet, sizeof unet / sizeof *unet);
}

BENCH(conv_winograd)
{
    static const ts_conv shape[] = {
        {1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},      {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}},
        {1, 256, 256, 32, 64, 3, 2, TS_PAD_REPLICATE, 0, {0}}, {1, 28, 28, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
        {1, 64, 64, 64, 9, 3, 1, TS_PAD_REPLICATE, 0, {0}},    {1, 64, 64, 9, 64, 3, 1, TS_PAD_REPLICATE, 0, {0}},
        {1, 64, 64, 18, 128, 5, 1, TS_PAD_REPLICATE, 0, {0}}};
    static const ts_conv trained[] = {{8, 64, 64, 48, 24, 3, 1, TS_PAD_ZERO, 0, {0}},
                                      {8, 32, 32, 96, 48, 3, 1, TS_PAD_ZERO, 0, {0}},
                                      {8, 64, 64, 64, 128, 3, 2, TS_PAD_REPLICATE, 0, {0}}};
    bench_heading("Winograd's algorithm, counting the direct way's multiplications, each below the direct way");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        row("forward", shape[i], forward);
        row("Winograd forward", shape[i], winograd);
    }
    bench_heading("The same in training: g's larger layers and a coarse step's");
    for (size_t i = 0; i < sizeof trained / sizeof *trained; i++) {
        row("forward", trained[i], forward);
        row("Winograd forward", trained[i], winograd);
        row("data gradient", trained[i], data_gradient);
        row("Winograd data gradient", trained[i], data_gradient_winograd);
        row("weight gradient", trained[i], weight_gradient);
        row("Winograd weight gradient", trained[i], weight_gradient_winograd);
    }
}

/* Where it is not emulated, % of the peak is that of the matrix unit or of vdpbf16ps: LGD_ISA=avx512bf16 for the latter
 * where there are both. */
BENCH(conv_bf16)
{
    bench_heading("bf16, inputs rounded on the way, each below f32");
    for (size_t i = 0; i < 5; i++) {
        row("forward", published[i], forward);
        row("bf16 forward", published[i], forward_bf16);
        row("data gradient", published[i], data_gradient);
        row("bf16 data gradient", published[i], data_gradient_bf16);
        row("weight gradient", published[i], weight_gradient);
        row("bf16 weight gradient", published[i], weight_gradient_bf16);
    }
}

/* Winograd's way where a layer may take it. */
static void weight_rows(ts_conv shape)
{
    row("weight gradient", shape, weight_gradient);
    row("bf16 weight gradient", shape, weight_gradient_bf16);
    if (shape.k != 3 || shape.h < 8) return;
    row("Winograd weight gradient", shape, weight_gradient_winograd);
    row("bf16 Winograd weight gradient", shape, weight_gradient_winograd_bf16);
}

/* Layers of configs/single-phone.ini. */
BENCH(conv_winograd_bf16)
{
    static const ts_conv shape[] = {
        {8, 64, 64, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},  {8, 64, 64, 96, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 32, 32, 128, 64, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 16, 16, 256, 128, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 64, 64, 16, 16, 3, 1, TS_PAD_ZERO, 0, {0}},  {8, 64, 64, 32, 16, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 32, 32, 16, 32, 3, 1, TS_PAD_ZERO, 0, {0}},  {8, 256, 256, 17, 16, 3, 1, TS_PAD_ZERO, 5, {0}}};
    bench_heading("Winograd's way and the direct one, in f32 and bf16");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        row("forward", shape[i], forward);
        row("Winograd forward", shape[i], winograd);
        row("bf16 forward", shape[i], forward_bf16);
        row("bf16 Winograd forward", shape[i], winograd_bf16);
        row("data gradient", shape[i], data_gradient);
        row("Winograd data gradient", shape[i], data_gradient_winograd);
        row("bf16 data gradient", shape[i], data_gradient_bf16);
        row("bf16 Winograd data gradient", shape[i], data_gradient_winograd_bf16);
        weight_rows(shape[i]);
    }
}

/* Layers of configs/single-g.ini and, the last, of configs/single-phone.ini. */
BENCH(weights_bf16)
{
    static const ts_conv shape[] = {
        {8, 64, 64, 9, 9, 3, 1, TS_PAD_ZERO, 0, {0}},   {8, 64, 64, 16, 16, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 64, 64, 32, 16, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 32, 32, 32, 32, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 32, 32, 64, 32, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 16, 16, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 8, 8, 256, 128, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 8, 8, 128, 128, 3, 1, TS_PAD_ZERO, 0, {0}},
        {8, 4, 4, 128, 128, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 64, 64, 64, 192, 1, 1, TS_PAD_ZERO, 0, {0}}};
    bench_heading("gradients of weights in f32 and bf16, directly and by Winograd's way");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        weight_rows(shape[i]);
    }
}

BENCH(peer_conv)
{
    static const ts_conv shape[] = {
        {1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},       {1, 256, 256, 20, 256, 5, 1, TS_PAD_REPLICATE, 0, {0}},
        {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}}, {1, 256, 256, 256, 192, 1, 1, TS_PAD_ZERO, 0, {0}},
        {1, 8, 8, 512, 512, 3, 1, TS_PAD_ZERO, 0, {0}},         {4, 80, 80, 18, 64, 5, 1, TS_PAD_REPLICATE, 0, {0}}};
    bench_heading("single convolutions beside their floor (the peak) and the peer");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        peer_row("forward", "conv", shape[i], forward, 1);
        if (ts_conv_choose(&shape[i], TS_CONV_OUTPUT) == TS_CONV_BY_WINOGRAD)
            peer_row("Winograd forward", "conv", shape[i], winograd, 1);
        peer_row("both gradients", "gradient", shape[i], both_gradients, 2);
    }
}

BENCH(two_threads)
{
    static const ts_conv shape[] = {{1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
                                    {1, 256, 256, 20, 256, 5, 1, TS_PAD_REPLICATE, 0, {0}},
                                    {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}}};
    static void (*const f[])(void *user) = {forward, data_gradient, weight_gradient, winograd};
    static const char *const what[] = {"forward", "data gradient", "weight gradient", "Winograd forward"};
    const int all = ts_threads();
    bench_heading("all threads beside one, and what the peak gains");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++)
        for (int k = 0; k < 4; k++) {
            if (k == 3 && ts_conv_choose(&shape[i], TS_CONV_OUTPUT) != TS_CONV_BY_WINOGRAD) continue;
            work w = make(shape[i]);
            ts_threads_set(1);
            const bench_time one = bench_measure(f[k], &w);
            ts_threads_set(all);
            const bench_time t = bench_measure(f[k], &w);
            char label[96];
            snprintf(label, sizeof label, "%s %d->%d %dx%d: %.2f x (peak %.2f x)", what[k], shape[i].ic, shape[i].oc,
                     shape[i].k, shape[i].k, one.seconds / t.seconds, t.peak / one.peak);
            bench_row_unit(label, t, all, "threads");
            discard(&w);
        }
}

BENCH(conv_naive)
{
    const ts_conv c = {1, 64, 64, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}};
    bench_heading("A convolution and its naive twin");
    row("forward", c, forward);
    row("naive forward", c, forward_naive);
}
