/* Packed weights of bf16 for the panels: pairs of channels in place of channels. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/pairs.h"
#include "tensor/team.h"

size_t conv_bf16_count(const ts_conv *c, int ic, int oc)
{
    return conv_amx_present() ? conv_amx_count(ic, oc, c->k, c->dilation)
                              : (size_t)conv_panels_count(conv_bf16_depth(ic), oc, c->k);
}

typedef struct pack_job {
    const ts_conv *c;
    const conv_weights *w;
    bool forward;
    int ic, taps, transposed, step, parts; /* inputs that are transposed at once, and of a part: whole pairs */
    float *packed;
} pack_job;

static void pack_part(const pack_job *j, int panel, int part)
{
    float of[2 * 2 * 16 * CONV_TRANSPOSED]; /* [input][tap][width]; no vector has more than 16 lanes */
    const int begin = part * j->step, count = j->ic - begin < j->step ? j->ic - begin : j->step;
    int width = 0;
    for (int i = 0; i < count; i += j->transposed)
        width = conv_transpose(j->c, j->w, j->forward, panel, begin + i,
                               count - i < j->transposed ? count - i : j->transposed, of + i * j->taps * width);
    const ptrdiff_t depth = conv_bf16_depth(j->ic);
    float *to = j->packed + (ptrdiff_t)panel * 2 * conv_lanes() * depth * j->taps;
    for (int t = 0; t < j->taps; t++)
        for (int i = 0; i < count; i += 2) {
            const float *even = of + (i * j->taps + (j->forward ? t : j->taps - 1 - t)) * width;
            ts_pairs_k()->of_two(even, i + 1 < count ? even + j->taps * width : NULL, 0, 1, width, width,
                                 to + (t * depth + (begin + i) / 2) * width, 0);
        }
}

static void pack_parts(const void *job, int64_t begin, int64_t end)
{
    const pack_job *j = job;
    for (int64_t i = begin; i < end; i++) pack_part(j, (int)(i / j->parts), (int)(i % j->parts));
}

/* packed: [panel][ky][kx][pair of inputs][channel of the panel, zeros where there is none] */
void conv_pack_bf16(const ts_conv *c, bool forward, const conv_weights *w, float *packed)
{
    if (conv_amx_present()) {
        conv_amx_pack(c, forward, w->full, packed);
        return;
    }
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), taps = c->k * c->k,
              transposed = conv_transposed_inputs(taps), step = transposed > 2 ? transposed & ~1 : 2,
              parts = (ic + step - 1) / step;
    ts_for(c->compute.threads, (int64_t)conv_panels(oc) * parts, 1, pack_parts,
           &(pack_job){c, w, forward, ic, taps, transposed < step ? transposed : step, step, parts, packed});
}
