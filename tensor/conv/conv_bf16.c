/* Convolutions of values rounded to bf16: the same ways as those of f32 (tensor/conv/conv.c), with pairs of channels in
 * place of channels. */
#include "tensor/conv/conv_internal.h"
#include "tensor/threads.h"

const char *ts_precision_name(ts_precision p) { return p == TS_BF16 ? "bf16" : "f32"; }

size_t conv_bf16_count(const ts_conv *c, int ic, int oc)
{
    return conv_by_matrix() ? conv_matrix_count(ic, oc, c->k, c->dilation)
                            : (size_t)conv_panels_count(conv_bf16_depth(ic), oc, c->k);
}

/* packed: [panel][ky][kx][pair of inputs][channel of the panel, zeros where there is none] */
void conv_pack_bf16(const ts_conv *c, bool forward, const float *weight, float *packed)
{
    if (conv_by_matrix()) {
        conv_matrix_pack(c, forward, weight, packed);
        return;
    }
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), taps = c->k * c->k,
              lanes = conv_lanes(), depth = conv_bf16_depth(ic);
    const int panels = conv_panels(oc);
    /* weight[o][c][tap]: strides of the packed input and output channel */
    const ptrdiff_t o_step = forward ? (ptrdiff_t)c->ic * taps : taps,
                    i_step = forward ? taps : (ptrdiff_t)c->ic * taps;
#pragma omp parallel for collapse(2) schedule(static) num_threads(ts_threads_of(c->compute.threads))
    for (int panel = 0; panel < panels; panel++)
        for (int i = 0; i < depth; i++) {
            const int width = conv_vectors(oc, panel) * lanes, o0 = panel * 2 * lanes;
            for (int t = 0; t < taps; t++) {
                float two[2 * 2 * 16] = {0}; /* vectors have no more than 16 lanes */
                for (int o = 0; o < width && o0 + o < oc; o++)
                    for (int half = 0; half < 2 && 2 * i + half < ic; half++)
                        two[2 * o + half] =
                            weight[(2 * i + half) * i_step + (o0 + o) * o_step + (forward ? t : taps - 1 - t)];
                ts_conv_k()->pairs(two, width, 2,
                                   packed + (ptrdiff_t)o0 * depth * taps + ((ptrdiff_t)t * depth + i) * width, 1);
            }
        }
}

void ts_conv_forward_bf16(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak,
                          float *y)
{
    const conv_plan p = {.threads = c->compute.threads,
                         .n = c->n,
                         .h = c->h,
                         .w = c->w,
                         .ic = conv_bf16_depth(c->ic),
                         .channels = c->ic,
                         .oc = c->oc,
                         .k = c->k,
                         .dilation = c->dilation,
                         .first = -c->dilation * (c->k / 2),
                         .replicate = c->pad == TS_PAD_REPLICATE,
                         .x = x,
                         .packed = packed,
                         .bias = bias,
                         .y = y,
                         .leak = leak,
                         .bf16 = true};
    conv_run(&p);
}

void ts_conv_data_gradient_bf16(const ts_conv *c, const float *dy, const float *packed, float *dx, bool accumulate)
{
    const int reach = c->dilation * (c->k / 2), fold = c->pad == TS_PAD_REPLICATE ? reach : 0;
    const conv_plan p = {.threads = c->compute.threads,
                         .n = c->n,
                         .h = c->h,
                         .w = c->w,
                         .ic = conv_bf16_depth(c->oc),
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
                         .add = accumulate,
                         .bf16 = true};
    conv_run(&p);
}
