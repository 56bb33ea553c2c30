/* The ways of computing a convolution and its gradients, on arrays of random values. */
#ifndef BENCH_CONV_WAYS_H
#define BENCH_CONV_WAYS_H
#include "bench/arrays.h"
#include "tensor/conv/conv.h"
#include <stdbool.h>
#include <stddef.h>

typedef struct bench_conv {
    ts_conv c;
    float *x, *y, *weight, *bias, *packed, *packed_gradient, *packed_winograd, *packed_gradient_winograd, *packed_bf16,
        *packed_gradient_bf16, *packed_winograd_bf16, *packed_gradient_winograd_bf16;
} bench_conv;

/* Arrays and weights packed for every way that the shape may take; discard frees them. */
bench_conv bench_conv_make(ts_conv c);
void bench_conv_discard(bench_conv *w);

enum {
    BENCH_FORWARD,
    BENCH_WINOGRAD,
    BENCH_FORWARD_BF16,
    BENCH_WINOGRAD_BF16,
    BENCH_DATA,
    BENCH_DATA_WINOGRAD,
    BENCH_DATA_BF16,
    BENCH_DATA_WINOGRAD_BF16,
    BENCH_WEIGHTS,
    BENCH_WEIGHTS_WINOGRAD,
    BENCH_WEIGHTS_BF16,
    BENCH_WEIGHTS_WINOGRAD_BF16,
    BENCH_NAIVE,
};
typedef struct bench_way {
    const char *name;
    void (*run)(void *conv);                                /* a bench_conv */
    enum { BENCH_OUTPUT, BENCH_INPUT, BENCH_KERNEL } makes; /* or its gradient */
    bool bf16;
    size_t packed; /* offset of its packed weights in bench_conv, and their use; a kernel's gradient has none */
    ts_conv_use use;
} bench_way;
extern const bench_way bench_ways[];

/* What it reads and writes. */
bench_arrays bench_conv_arrays(const bench_conv *w, const bench_way *by);
#endif
