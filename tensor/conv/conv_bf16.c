/* Packed weights of bf16 for the panels: pairs of channels in place of channels. */
#include "tensor/conv/plan.h"
#include "tensor/team.h"

size_t conv_bf16_count(const ts_conv *c, int ic, int oc)
{
    return conv_amx_present() ? conv_amx_count(ic, oc, c->k, c->dilation)
                              : (size_t)conv_panels_count(conv_bf16_depth(ic), oc, c->k);
}

typedef struct pack_job {
    bool forward;
    int ic, oc, taps, depth;
    ptrdiff_t o_step, i_step;
    const float *weight;
    float *packed;
} pack_job;

static void pack_pairs(const void *job, int64_t begin, int64_t end)
{
    const pack_job *j = job;
    for (int64_t at = begin; at < end; at++) {
        const int panel = (int)(at / j->depth), i = (int)(at % j->depth), lanes = conv_lanes(),
                  width = conv_vectors(j->oc, panel) * lanes, o0 = panel * 2 * lanes;
        for (int t = 0; t < j->taps; t++) {
            float two[2 * 2 * 16] = {0}; /* vectors have no more than 16 lanes */
            for (int o = 0; o < width && o0 + o < j->oc; o++)
                for (int half = 0; half < 2 && 2 * i + half < j->ic; half++)
                    two[2 * o + half] = j->weight[(2 * i + half) * j->i_step + (o0 + o) * j->o_step +
                                                  (j->forward ? t : j->taps - 1 - t)];
            ts_conv_k()->pairs(two, width, 2,
                               j->packed + (ptrdiff_t)o0 * j->depth * j->taps + ((ptrdiff_t)t * j->depth + i) * width,
                               1);
        }
    }
}

/* packed: [panel][ky][kx][pair of inputs][channel of the panel, zeros where there is none] */
void conv_pack_bf16(const ts_conv *c, bool forward, const float *weight, float *packed)
{
    if (conv_amx_present()) {
        conv_amx_pack(c, forward, weight, packed);
        return;
    }
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), taps = c->k * c->k,
              depth = conv_bf16_depth(ic);
    /* weight[o][c][tap]: strides of the packed input and output channel */
    const ptrdiff_t o_step = forward ? (ptrdiff_t)c->ic * taps : taps,
                    i_step = forward ? taps : (ptrdiff_t)c->ic * taps;
    ts_for(c->compute.threads, (int64_t)conv_panels(oc) * depth, 1, pack_pairs,
           &(pack_job){forward, ic, oc, taps, depth, o_step, i_step, weight, packed});
}
