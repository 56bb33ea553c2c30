/* Which way a convolution goes, and what its weights are packed for. */
#ifndef TS_CONV_CHOOSE_H
#define TS_CONV_CHOOSE_H
#include "tensor/conv/shape.h"

/* Of the output, or of a gradient, by shape, c->compute and the ISA in use (conv_choose.c says why). */
ts_conv_way ts_conv_choose(const ts_conv *c, ts_conv_direction direction);
/* What its weights are packed for; not for TS_CONV_WEIGHTS. */
ts_conv_use ts_conv_packing(const ts_conv *c, ts_conv_direction direction);
/* Whether the output, or the gradient of weights, is made of constants in an array of their own (tensor/conv/conv.h),
 * and whether the output is added to a base. */
bool ts_conv_joins(const ts_conv *c, ts_conv_direction direction);
bool ts_conv_adds(const ts_conv *c);
/* Whether gradients of weights are made of rounded values: of those of c->compute, where that costs no time. */
bool ts_conv_rounds_weights(const ts_conv *c);
const char *ts_conv_way_name(ts_conv_way way);
#endif
