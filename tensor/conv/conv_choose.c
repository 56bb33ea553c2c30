/* Which way a convolution goes. Nobody else decides: the tape, packing and the entries in conv.c ask here. */
#include "tensor/conv/conv_choose.h"
#include "tensor/conv/conv_winograd.h"

const char *ts_conv_way_name(ts_conv_way way)
{
    static const char *const names[] = {"direct", "pointwise", "batch", "col2im", "pixel lanes", "Winograd", "AMX"};
    return names[way];
}

/* Small maps in a batch: a register tile holds one pixel position of several images, so nothing is padded. With fewer
 * than 8 images the tile is half empty and pays only up to 16 pixels. */
static bool small_maps(const ts_conv *c)
{
    return c->n >= 4 && (int64_t)c->h * c->w <= (c->n < 8 ? CONV_BATCH_PIXELS / 4 : CONV_BATCH_PIXELS);
}

/* In twelfths of an FMA per input, pixel and tap: panels of one vector are held back by their loads. */
static int64_t panel_cost(int oc, int pixels)
{
    const int vectors = conv_whole(oc) / conv_lanes();
    return (int64_t)vectors * conv_lanes() * pixels * (vectors == 1 ? 13 : 12);
}

/* The same with pixels in the lanes, which leaves none empty but at the end of a row. */
static bool pixel_lanes_pay(int oc, int k)
{
    return k > 1 && oc <= 2 * conv_lanes() && (int64_t)15 * oc * 64 < panel_cost(oc, 64);
}

/* In tenths of an FMA of a lane; the constants are of measured times, by AVX-512. To add a product costs as much as to
 * make it of 25 inputs. */
static bool col2im_pays(int ic, int oc, int k)
{
    if (k == 1 || oc > 2 * conv_lanes()) return false;
    const int64_t products = (int64_t)k * k * ic, here = (int64_t)12 * conv_whole(k * k * oc) * (ic + 25);
    return here < products * 13 * conv_whole(oc) && (!pixel_lanes_pay(oc, k) || here < products * (13 * oc + 70));
}

ts_conv_way conv_choose_narrow(int ic, int oc, int k)
{
    return col2im_pays(ic, oc, k) ? TS_CONV_BY_COL2IM
        : pixel_lanes_pay(oc, k)  ? TS_CONV_BY_PIXEL_LANES
                                  : TS_CONV_DIRECTLY;
}

/* 36 products in place of 144, or of side 5 in place of 100, pay for the transformations. Tiles that are mostly outside
 * cost what that saves, and fewer than so many save less than the transformation of the weights costs: with 32 it is
 * done in .6 of the direct way's time, packing included, with 16 in as much. 5 x 5 18 -> 128 takes .55 of it. */
static bool tiles_pay(const ts_conv *c, int least)
{
    if (c->k != 3 && (c->k != 5 || c->compute.precision == TS_BF16)) return false;
    const winograd_grid g = winograd_grid_forward(c, false);
    return g.tiles >= least && 2 * g.tiles * g.side * g.side <= 3 * (int64_t)c->n * c->h * c->w;
}

/* With few channels most lanes of the transforms are empty: from 9 to 9 the direct way takes .8 of the time, from 16 to
 * 9 as much; from 9 to 16 1.3 times as much, from 64 to 9 1.8 times, from 16 to 16 1.4 to 2 times, in bf16 1.2 to 1.3.
 * From 16 to 12 or more it takes 1.2 to 1.8 times as much in f32 (with AVX2 .95 to 1.2 times), in bf16 .8 to 1.1.
 */
static bool winograd_pays(const ts_conv *c, int ic, int oc)
{
    const bool f32 = c->compute.precision == TS_F32;
    const bool few = c->k == 3 && ((ic >= 9 && oc >= 16) || (ic >= 32 && oc >= 9) || (f32 && ic >= 16 && oc >= 12));
    return ((ic >= 16 && oc >= 16) || few) && tiles_pay(c, 32);
}

/* Of weights, from 16 x 16 pixels in batches of 8 on in .35 to .4 of the direct way's time, of bf16 too, at 8 x 8 in
 * .5 to .65, of bf16 in .7 to 1.05; from 9 to 64 channels in .6, from 64 to 9 in .87, from 16 to 9 in .88 to 1.06. */
static bool winograd_pays_for_weights(const ts_conv *c)
{
    const int least = c->ic < c->oc ? c->ic : c->oc, most = c->ic < c->oc ? c->oc : c->ic;
    return c->k == 3 && (least >= 16 || (least >= 9 && most >= 32)) && tiles_pay(c, 32);
}

static ts_conv_way choose_weights(const ts_conv *c, bool bf16)
{
    if (bf16 && conv_amx_present()) return TS_CONV_BY_AMX;
    if (!c->compute.exact && winograd_pays_for_weights(c)) return TS_CONV_BY_WINOGRAD;
    if (c->k > 1 && (int64_t)c->h * c->w <= CONV_BATCH_PIXELS)
        return TS_CONV_BY_BATCH; /* padding is never multiplied */
    return TS_CONV_DIRECTLY;
}

ts_conv_way ts_conv_choose(const ts_conv *c, ts_conv_direction direction)
{
    const bool forward = direction == TS_CONV_OUTPUT, bf16 = c->compute.precision == TS_BF16;
    if (direction == TS_CONV_WEIGHTS) return choose_weights(c, bf16);
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c);
    if (bf16 && conv_amx_present()) return TS_CONV_BY_AMX; /* 8 to 16 times the products of f32 */
    if (!c->compute.exact && winograd_pays(c, ic, oc)) return TS_CONV_BY_WINOGRAD; /* half the time, of bf16 too */
    if (c->k == 1) return TS_CONV_POINTWISE; /* all images are one row: no window */
    if (small_maps(c)) return TS_CONV_BY_BATCH;
    if (bf16) return TS_CONV_DIRECTLY; /* pairs have no narrow way */
    const ts_conv_way narrow = conv_choose_narrow(ic, oc, c->k);
    const int fold = forward || c->pad == TS_PAD_ZERO ? 0 : c->dilation * (c->k / 2), width = c->w + 2 * fold;
    if (narrow == TS_CONV_BY_PIXEL_LANES && (int64_t)14 * oc * conv_whole(width) >= panel_cost(oc, width))
        return TS_CONV_DIRECTLY; /* rows so narrow that lanes stay empty at their end */
    return narrow;
}

static bool transforms(const ts_conv *c, ts_conv_direction direction)
{
    const ts_conv_way way = ts_conv_choose(c, direction);
    return way == TS_CONV_BY_WINOGRAD || way == TS_CONV_BY_AMX;
}

bool ts_conv_adds(const ts_conv *c) { return transforms(c, TS_CONV_OUTPUT); }

/* The output's pairs are of channels: none may be of both arrays. */
bool ts_conv_joins(const ts_conv *c, ts_conv_direction direction)
{
    return transforms(c, direction) &&
        (direction == TS_CONV_WEIGHTS || c->compute.precision == TS_F32 || ts_conv_variables(c) % 2 == 0);
}

bool ts_conv_rounds_weights(const ts_conv *c)
{
    if (c->compute.precision != TS_BF16) return false;
    const ts_conv_way way = ts_conv_choose(c, TS_CONV_WEIGHTS);
    if (way == TS_CONV_BY_WINOGRAD || way == TS_CONV_BY_AMX) return true;
    /* Of side 1, to copy pairs costs as much as products save where there are few: 32 -> 48 takes 1.0 of f32's time,
     * 64 -> 192 and 192 -> 64 .73, 256 -> 192 .65. */
    return ts_isa_now() >= TS_AVX512BF16 && (c->k > 1 || (c->ic >= 48 && c->oc >= 48));
}

/* Whether values are rounded for products: of side 1, to round few channels takes longer than it saves. */
static bool rounds(const ts_conv *c)
{
    return c->compute.precision == TS_BF16 && (conv_amx_present() || c->k > 1 || (c->ic >= 16 && c->oc >= 16));
}

ts_conv_use ts_conv_packing(const ts_conv *c, ts_conv_direction direction)
{
    static const ts_conv_use uses[2][2][2] = {
        {{TS_CONV_DATA_GRADIENT, TS_CONV_DATA_GRADIENT_BF16},
         {TS_CONV_DATA_GRADIENT_WINOGRAD, TS_CONV_DATA_GRADIENT_WINOGRAD_BF16}},
        {{TS_CONV_FORWARD, TS_CONV_FORWARD_BF16}, {TS_CONV_WINOGRAD, TS_CONV_WINOGRAD_BF16}}};
    return uses[direction == TS_CONV_OUTPUT][ts_conv_choose(c, direction) == TS_CONV_BY_WINOGRAD][rounds(c)];
}
