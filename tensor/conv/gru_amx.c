/* The products of the gated unit on the matrix unit, in bf16. */
#include "tensor/conv/gru_internal.h"
#include "tensor/kernels/amx_conv.h"
#include "tensor/kernels/pairs.h"
#include "tensor/scratch.h"
#include <string.h>

enum {
    STEP_PIXELS = 2 * TS_AMX_PAIRS,
    PLANE = (GRU_BAND + STEP_PIXELS - 1) / STEP_PIXELS * STEP_PIXELS /* pixels of a channel in whole steps */
};

/* The chunks of z, r and n' begin and end with steps. */
bool ts_gru_backward_bf16(const ts_gru *g) { return g->bf16 && conv_amx_present() && g->c % TS_AMX_PAIRS == 0; }

static int whole(int channels) { return (channels + TS_AMX_SIDE - 1) / TS_AMX_SIDE * TS_AMX_SIDE; }

gru_rounded gru_round(const ts_gru *g, const float *d, int count)
{
    const int c = g->c, widest = whole(g->ic > c ? g->ic : c);
    const size_t pairs = (size_t)(GRU_BAND + CONV_AMX_SLACK) * 2 * (size_t)c + CONV_AMX_SLACK,
                 planes = (size_t)PLANE * 2 * (size_t)c;
    gru_rounded r = {.c = c,
                     .count = count,
                     .pairs = ts_scratch(1, sizeof(float) * (pairs + planes + (size_t)(PLANE / 2 * widest)))};
    r.planes = (uint16_t *)(void *)(r.pairs + pairs);
    r.others = r.pairs + pairs + planes;
    ts_pairs_k()->of_channels(d, count, 4 * c, r.pairs, 2 * c);
    memset(r.pairs + (ptrdiff_t)count * 2 * c, 0, sizeof(float) * (pairs - (size_t)count * 2 * (size_t)c));
    memset(r.planes, 0, sizeof(float) * planes);
    ts_amx_k()->planes(d, 4 * c, count, 4 * c, r.planes, PLANE);
    return r;
}

void gru_amx_product(const gru_rounded *r, bool hidden, const float *packed, int oc, float *y, bool add)
{
    const int c = r->c, steps = (3 * c + STEP_PIXELS - 1) / STEP_PIXELS,
              of_n = c / TS_AMX_PAIRS; /* the step that n begins with */
    ptrdiff_t *at = ts_scratch(3, sizeof *at * (size_t)steps);
    for (int s = 0; s < steps; s++)
        at[s] = (s < of_n || hidden ? c / 2 + s * TS_AMX_PAIRS : (s - of_n) * TS_AMX_PAIRS) * (ptrdiff_t)sizeof(float);
    const conv_plan p = {
        .ic = 2 * c, .oc = oc, .k = 1, .x = r->pairs, .packed = packed, .y = y, .leak = 1, .base = add ? y : NULL};
    conv_amx_steps(&p, at, steps, r->count);
}

void gru_amx_weights(const gru_rounded *r, bool hidden, const float *x, int channels, float *sum)
{
    const struct ts_amx_kernels *k = ts_amx_k();
    const int gates = 3 * r->c, width = whole(channels), steps = (r->count + STEP_PIXELS - 1) / STEP_PIXELS,
              pairs = (r->count + 1) / 2;
    ptrdiff_t at[PLANE / STEP_PIXELS];
    for (int s = 0; s < steps; s++) at[s] = s * (ptrdiff_t)(STEP_PIXELS * sizeof(uint16_t));
    k->pixel_pairs(x, channels, r->count, channels, r->others, width);
    memset(r->others + (ptrdiff_t)pairs * width, 0,
           sizeof(float) * (size_t)(steps * TS_AMX_PAIRS - pairs) * (size_t)width);
    k->begin();
    for (int i = 0; i < width; i += TS_AMX_BLOCK)
        for (int m = 0; m < gates; m += TS_AMX_BLOCK) {
            const ts_amx_product product = {.a = r->planes + (ptrdiff_t)(m + (hidden ? r->c : 0)) * PLANE,
                                            .b = r->others + i,
                                            .a_at = at,
                                            .a_row = PLANE * (ptrdiff_t)sizeof *r->planes,
                                            .b_row = width,
                                            .steps = steps,
                                            .c = sum + (ptrdiff_t)m * width + i,
                                            .c_row = width,
                                            .add = true};
            k->product[gates - m > TS_AMX_SIDE][width - i > TS_AMX_SIDE](&product);
        }
    k->end();
}
