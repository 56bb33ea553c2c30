/* Convolutions and their gradients: sizes of the published networks at 256 x 256, and of a small model in training. */
#include "bench/bench.h"
#include "bench/conv_ways.h"
#include "tensor/threads.h"
#include <stdio.h>
#include <string.h>

static void row(ts_conv c, int way)
{
    char label[96];
    const bench_way *by = &bench_ways[way];
    snprintf(label, sizeof label, "%s n%d %dx%d %d->%d %dx%d%s%s", by->name, c.n, c.h, c.w, c.ic, c.oc, c.k, c.k,
             c.dilation > 1 ? " d2" : "", c.pad == TS_PAD_REPLICATE ? " rep" : "");
    const bool back = by->makes == BENCH_INPUT;
    if (back && c.constants)
        snprintf(label + strlen(label), sizeof label - strlen(label), " (of %d)", ts_conv_variables(&c));
    bench_conv w = bench_conv_make(c);
    bench_time t = bench_measure(by->run, &w);
    if (by->bf16 && !bench_bf16(&t)) snprintf(label + strlen(label), sizeof label - strlen(label), ", emulated");
    bench_row(label, t, 2.0 * c.n * c.h * c.w * (back ? ts_conv_variables(&c) : c.ic) * c.oc * c.k * c.k);
    bench_arrays arrays = bench_conv_arrays(&w, by);
    bench_row_arrays(t, &arrays);
    bench_conv_discard(&w);
}

static void peer_row(const char *what, const char *job, ts_conv c, void (*f)(void *user), double times)
{
    char label[96], text[128];
    snprintf(label, sizeof label, "%s n%d %dx%d %d->%d %dx%d%s", what, c.n, c.h, c.w, c.ic, c.oc, c.k, c.k,
             c.dilation > 1 ? " d2" : "");
    snprintf(text, sizeof text, "%s %d %d %d %d %d %d %d %s", job, c.n, c.h, c.w, c.ic, c.oc, c.k, c.dilation,
             c.pad == TS_PAD_ZERO ? "zero" : "replicate");
    bench_conv w = bench_conv_make(c);
    const double flop = times * 2.0 * c.n * c.h * c.w * c.ic * c.oc * c.k * c.k;
    const bench_time t = bench_measure(f, &w);
    bench_row(label, t, flop);
    bench_row_peers(t, flop, text);
    bench_conv_discard(&w);
}

static void both_gradients(void *user)
{
    bench_ways[BENCH_DATA].run(user);
    bench_ways[BENCH_WEIGHTS].run(user);
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

/* Some layers of each size of a U-Net that is 24 channels wide; and larger kernels. */
static const ts_conv unet[] = {
    {8, 64, 64, 3, 24, 3, 1, TS_PAD_ZERO, 0, {0}},  {8, 32, 32, 24, 48, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 16, 16, 96, 96, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 8, 8, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 4, 4, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 2, 2, 192, 192, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 8, 8, 384, 192, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 16, 16, 192, 96, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 32, 32, 96, 48, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 64, 64, 48, 24, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 64, 64, 24, 24, 3, 1, TS_PAD_ZERO, 0, {0}}, {8, 64, 64, 24, 9, 3, 1, TS_PAD_ZERO, 0, {0}},
    {8, 8, 8, 64, 128, 5, 1, TS_PAD_ZERO, 0, {0}},  {8, 16, 16, 128, 64, 5, 1, TS_PAD_ZERO, 0, {0}},
};

/* Rows of a shape, as many ways as the list has. */
#define ROWS(shape, ...) rows((shape), (const int[]){__VA_ARGS__}, sizeof((const int[]){__VA_ARGS__}) / sizeof(int))
static void rows(ts_conv shape, const int *way, size_t ways)
{
    for (size_t i = 0; i < ways; i++) row(shape, way[i]);
}

static void all(const ts_conv *shape, size_t count)
{
    static const int way[] = {BENCH_FORWARD, BENCH_DATA, BENCH_WEIGHTS};
    for (size_t k = 0; k < sizeof way / sizeof *way; k++)
        for (size_t i = 0; i < count; i++) row(shape[i], way[k]);
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
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) ROWS(shape[i], BENCH_FORWARD, BENCH_WINOGRAD);
    bench_heading("The same in training: g's larger layers and a coarse step's");
    for (size_t i = 0; i < sizeof trained / sizeof *trained; i++)
        ROWS(trained[i], BENCH_FORWARD, BENCH_WINOGRAD, BENCH_DATA, BENCH_DATA_WINOGRAD, BENCH_WEIGHTS,
             BENCH_WEIGHTS_WINOGRAD);
}

/* Where it is not emulated, % of the peak is that of the matrix unit or of vdpbf16ps: LGD_ISA=avx512bf16 for the latter
 * where there are both. */
BENCH(conv_bf16)
{
    bench_heading("bf16, inputs rounded on the way, each below f32");
    for (size_t i = 0; i < 5; i++)
        ROWS(published[i], BENCH_FORWARD, BENCH_FORWARD_BF16, BENCH_DATA, BENCH_DATA_BF16, BENCH_WEIGHTS,
             BENCH_WEIGHTS_BF16);
}

/* Winograd's way where a layer may take it. */
static void weight_rows(ts_conv shape)
{
    ROWS(shape, BENCH_WEIGHTS, BENCH_WEIGHTS_BF16);
    if (shape.k == 3 && shape.h >= 8) ROWS(shape, BENCH_WEIGHTS_WINOGRAD, BENCH_WEIGHTS_WINOGRAD_BF16);
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
        ROWS(shape[i], BENCH_FORWARD, BENCH_WINOGRAD, BENCH_FORWARD_BF16, BENCH_WINOGRAD_BF16, BENCH_DATA,
             BENCH_DATA_WINOGRAD, BENCH_DATA_BF16, BENCH_DATA_WINOGRAD_BF16);
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
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) weight_rows(shape[i]);
}

BENCH(peer_conv)
{
    static const ts_conv shape[] = {
        {1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},       {1, 256, 256, 20, 256, 5, 1, TS_PAD_REPLICATE, 0, {0}},
        {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}}, {1, 256, 256, 256, 192, 1, 1, TS_PAD_ZERO, 0, {0}},
        {1, 8, 8, 512, 512, 3, 1, TS_PAD_ZERO, 0, {0}},         {4, 80, 80, 18, 64, 5, 1, TS_PAD_REPLICATE, 0, {0}}};
    bench_heading("single convolutions beside their floor (the peak) and the peer");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        peer_row("forward", "conv", shape[i], bench_ways[BENCH_FORWARD].run, 1);
        if (ts_conv_choose(&shape[i], TS_CONV_OUTPUT) == TS_CONV_BY_WINOGRAD)
            peer_row("Winograd forward", "conv", shape[i], bench_ways[BENCH_WINOGRAD].run, 1);
        peer_row("both gradients", "gradient", shape[i], both_gradients, 2);
    }
}

BENCH(conv_threads)
{
    static const ts_conv shape[] = {{1, 256, 256, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}},
                                    {1, 256, 256, 20, 256, 5, 1, TS_PAD_REPLICATE, 0, {0}},
                                    {1, 256, 256, 64, 256, 3, 2, TS_PAD_REPLICATE, 0, {0}}};
    static const int ways[] = {BENCH_FORWARD, BENCH_DATA, BENCH_WEIGHTS, BENCH_WINOGRAD};
    bench_heading("all threads beside one, and what the peak gains");
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++)
        for (int k = 0; k < 4; k++) {
            if (k == 3 && ts_conv_choose(&shape[i], TS_CONV_OUTPUT) != TS_CONV_BY_WINOGRAD) continue;
            const bench_way *by = &bench_ways[ways[k]];
            bench_conv w = bench_conv_make(shape[i]);
            char label[96];
            snprintf(label, sizeof label, "%s %d->%d %dx%d", by->name, shape[i].ic, shape[i].oc, shape[i].k,
                     shape[i].k);
            const ts_conv *c = &shape[i];
            bench_row(label, bench_measure(by->run, &w), 2.0 * c->n * c->h * c->w * c->ic * c->oc * c->k * c->k);
            bench_row_threads(by->run, &w);
            bench_conv_discard(&w);
        }
}

BENCH(conv_naive)
{
    const ts_conv c = {1, 64, 64, 64, 64, 3, 1, TS_PAD_ZERO, 0, {0}};
    bench_heading("A convolution and its naive twin");
    ROWS(c, BENCH_FORWARD, BENCH_NAIVE);
}
