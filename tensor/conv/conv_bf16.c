/* Packed weights of bf16 for the panels: pairs of channels in place of channels. */
#include "tensor/conv/plan.h"
#include "tensor/threads.h"

size_t conv_bf16_count(const ts_conv *c, int ic, int oc)
{
    return conv_amx_present() ? conv_amx_count(ic, oc, c->k, c->dilation)
                              : (size_t)conv_panels_count(conv_bf16_depth(ic), oc, c->k);
}

/* packed: [panel][ky][kx][pair of inputs][channel of the panel, zeros where there is none] */
void conv_pack_bf16(const ts_conv *c, bool forward, const float *weight, float *packed)
{
    if (conv_amx_present()) {
        conv_amx_pack(c, forward, weight, packed);
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
