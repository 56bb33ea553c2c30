/* Convolution: checks, and the entries, which hand a plan to the way that conv_choose.c names. */
#include "tensor/conv/conv.h"
#include "tensor/conv/plan.h"
#include "tensor/team.h"

ts_code ts_conv_check(const ts_conv *c, ts_status *st)
{
    if (c->n < 1 || c->h < 1 || c->w < 1 || c->ic < 1 || c->oc < 1)
        return ts_fail(st, TS_INVALID,
                       "convolution of %d x %d x %d x %d to %d channels: every dimension must be at least 1", c->n,
                       c->h, c->w, c->ic, c->oc);
    if (c->k < 1 || c->k > 15 || c->k % 2 == 0)
        return ts_fail(st, TS_INVALID, "convolution kernel of side %d: use an odd side from 1 to 15", c->k);
    if (c->dilation != 1 && c->dilation != 2)
        return ts_fail(st, TS_INVALID, "convolution dilation %d: use 1 or 2", c->dilation);
    if (c->pad != TS_PAD_ZERO && c->pad != TS_PAD_REPLICATE)
        return ts_fail(st, TS_INVALID, "convolution padding %d: use TS_PAD_ZERO or TS_PAD_REPLICATE", (int)c->pad);
    if (c->constants < 0 || c->constants >= c->ic)
        return ts_fail(st, TS_INVALID, "convolution of %d channels of which %d are constants: there must be others",
                       c->ic, c->constants);
    const int64_t limit = INT64_C(1) << 40; /* floats: offsets stay far from overflow */
    const int64_t pixels = (int64_t)c->h * c->w, channels = c->ic > c->oc ? c->ic : c->oc;
    if (pixels > limit / c->n || pixels * c->n > limit / channels ||
        (int64_t)c->ic * c->oc > (INT64_C(1) << 31) / (c->k * c->k))
        return ts_fail(st, TS_INVALID, "convolution of %d x %d x %d x %d to %d channels with side %d is too large",
                       c->n, c->h, c->w, c->ic, c->oc, c->k);
    return TS_OK;
}

static void run(const conv_plan *p, ts_conv_way way)
{
    static void (*const runs[])(const conv_plan *) = {[TS_CONV_DIRECTLY] = conv_run_direct,
                                                      [TS_CONV_POINTWISE] = conv_run_pointwise,
                                                      [TS_CONV_BY_BATCH] = conv_run_batch,
                                                      [TS_CONV_BY_COL2IM] = conv_run_col2im,
                                                      [TS_CONV_BY_PIXEL_LANES] = conv_run_pixel_lanes,
                                                      [TS_CONV_BY_AMX] = conv_run_amx};
    runs[way](p);
}

/* Which of the ways without Winograd's. */
static ts_conv_way choose_direct(const ts_conv *c, ts_conv_direction direction, ts_precision precision)
{
    ts_conv direct = *c;
    direct.compute.exact = true;
    direct.compute.precision = precision;
    return ts_conv_choose(&direct, direction);
}

static void forward(const ts_conv *c, bool bf16, const ts_conv_inputs *in, const float *packed, float leak, float *y)
{
    const int apart = in->constants ? c->constants : 0;
    const conv_plan p = {.n = c->n,
                         .h = c->h,
                         .w = c->w,
                         .ic = bf16 ? conv_bf16_depth(c->ic) : c->ic,
                         .channels = c->ic - apart,
                         .constants = apart,
                         .oc = c->oc,
                         .k = c->k,
                         .dilation = c->dilation,
                         .first = -c->dilation * (c->k / 2),
                         .replicate = c->pad == TS_PAD_REPLICATE,
                         .x = in->x,
                         .more = in->constants,
                         .packed = packed,
                         .bias = in->bias,
                         .base = in->base,
                         .y = y,
                         .leak = leak,
                         .bf16 = bf16,
                         .threads = c->compute.threads};
    run(&p, choose_direct(c, TS_CONV_OUTPUT, bf16 ? TS_BF16 : TS_F32));
}

void ts_conv_forward(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y)
{
    forward(c, false, in, packed, leak, y);
}

void ts_conv_forward_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y)
{
    forward(c, true, in, packed, leak, y);
}

/* A convolution of dy with mirrored, transposed weights. */
static void data_gradient(const ts_conv *c, bool bf16, const float *dy, const float *packed, float *dx, bool accumulate)
{
    const int reach = c->dilation * (c->k / 2), fold = c->pad == TS_PAD_REPLICATE ? reach : 0;
    const conv_plan p = {.n = c->n,
                         .h = c->h,
                         .w = c->w,
                         .ic = bf16 ? conv_bf16_depth(c->oc) : c->oc,
                         .channels = c->oc,
                         .oc = ts_conv_variables(c),
                         .k = c->k,
                         .dilation = c->dilation,
                         .first = -reach - fold,
                         .fold = fold,
                         .x = dy,
                         .packed = packed,
                         .y = dx,
                         .leak = 1,
                         .base = accumulate ? dx : NULL,
                         .bf16 = bf16,
                         .threads = c->compute.threads};
    run(&p, choose_direct(c, TS_CONV_INPUT, bf16 ? TS_BF16 : TS_F32));
}

void ts_conv_data_gradient(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate)
{
    data_gradient(c, false, dy, packed, dx, accumulate);
}

void ts_conv_data_gradient_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate)
{
    data_gradient(c, true, dy, packed, dx, accumulate);
}

void ts_conv_weight_gradient(const ts_conv *c, const float *x, const float *dy, float *dweight, float *dbias)
{
    if (dweight && choose_direct(c, TS_CONV_WEIGHTS, TS_F32) == TS_CONV_BY_BATCH) {
        conv_batch_weight_gradient(c, false, x, dy, dweight);
        dweight = NULL;
    }
    if (dweight || dbias) conv_direct_weight_gradient(c, false, x, dy, dweight, dbias);
}

void ts_conv_weight_gradient_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight)
{
    const ts_conv_way way = choose_direct(c, TS_CONV_WEIGHTS, TS_BF16);
    if (way == TS_CONV_BY_AMX) conv_amx_weight_gradient(c, in, dy, dweight);
    else if (way == TS_CONV_BY_BATCH) conv_batch_weight_gradient(c, true, in->x, dy, dweight);
    else conv_direct_weight_gradient(c, true, in->x, dy, dweight, NULL);
}

void ts_conv_forward_winograd(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak, float *y)
{
    conv_winograd_forward(c, false, in, packed, leak, y);
}

void ts_conv_forward_winograd_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *packed, float leak,
                                   float *y)
{
    conv_winograd_forward(c, true, in, packed, leak, y);
}

void ts_conv_data_gradient_winograd(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate)
{
    conv_winograd_data_gradient(c, false, dy, packed, dx, accumulate);
}

void ts_conv_data_gradient_winograd_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx,
                                         bool accumulate)
{
    conv_winograd_data_gradient(c, true, dy, packed, dx, accumulate);
}

void ts_conv_weight_gradient_winograd(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight)
{
    conv_winograd_weight_gradient(c, false, in, dy, dweight);
}

void ts_conv_weight_gradient_winograd_bf16(const ts_conv *c, const ts_conv_inputs *in, const float *dy, float *dweight)
{
    conv_winograd_weight_gradient(c, true, in, dy, dweight);
}
