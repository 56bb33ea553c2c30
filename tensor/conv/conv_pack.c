/* Packed weights: how many numbers, and in which order for each way. */
#include "tensor/conv/conv.h"
#include "tensor/conv/plan.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/team.h"
#include <stdlib.h>
#include <string.h>

size_t ts_conv_packed_count(const ts_conv *c, ts_conv_use use)
{
    const bool winograd_bf16 = use == TS_CONV_WINOGRAD_BF16 || use == TS_CONV_DATA_GRADIENT_WINOGRAD_BF16;
    if (use == TS_CONV_WINOGRAD || use == TS_CONV_WINOGRAD_BF16)
        return conv_winograd_count(c->ic, c->oc, winograd_bf16);
    if (use == TS_CONV_DATA_GRADIENT_WINOGRAD || winograd_bf16)
        return conv_winograd_count(c->oc, ts_conv_variables(c), winograd_bf16);
    if (use == TS_CONV_FORWARD_BF16) return conv_bf16_count(c, c->ic, c->oc);
    if (use == TS_CONV_DATA_GRADIENT_BF16) return conv_bf16_count(c, c->oc, ts_conv_variables(c));
    const int ic = use == TS_CONV_FORWARD ? c->ic : c->oc, oc = use == TS_CONV_FORWARD ? c->oc : ts_conv_variables(c);
    const size_t panels = (size_t)conv_panels_count(ic, oc, c->k);
    const ts_conv_way narrow = conv_choose_narrow(ic, oc, c->k);
    if (narrow == TS_CONV_BY_COL2IM) return panels + (size_t)conv_col2im_count(ic, oc, c->k);
    return panels + (narrow == TS_CONV_BY_PIXEL_LANES ? (size_t)ic * (size_t)oc * (size_t)(c->k * c->k) : 0);
}

typedef struct panels_job {
    const ts_conv *c;
    const conv_weights *w;
    bool forward;
    int ic, taps, step, parts;
    float *packed;
} panels_job;

static void pack_part(const panels_job *j, int panel, int part)
{
    float transposed[2 * 16 * CONV_TRANSPOSED];
    const int begin = part * j->step, count = j->ic - begin < j->step ? j->ic - begin : j->step;
    const int width = conv_transpose(j->c, j->w, j->forward, panel, begin, count, transposed);
    float *to = j->packed + (ptrdiff_t)panel * 2 * conv_lanes() * j->ic * j->taps;
    for (int t = 0; t < j->taps; t++)
        ts_elementwise_k()->copy(count, width, transposed + (j->forward ? t : j->taps - 1 - t) * width,
                                 (int64_t)j->taps * width, to + ((ptrdiff_t)t * j->ic + begin) * width, width, false);
}

static void pack_parts(const void *job, int64_t begin, int64_t end)
{
    const panels_job *j = job;
    for (int64_t i = begin; i < end; i++) pack_part(j, (int)(i / j->parts), (int)(i % j->parts));
}

/* packed: [panel][ky][kx][input][channel of the panel, zeros where there is none] */
static void pack_panels(const ts_conv *c, const conv_weights *w, bool forward, float *packed)
{
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), taps = c->k * c->k;
    const int step = conv_transposed_inputs(taps), parts = (ic + step - 1) / step;
    ts_for(c->compute.threads, (int64_t)conv_panels(oc) * parts, 1, pack_parts,
           &(panels_job){c, w, forward, ic, taps, step, parts, packed});
}

/* Whether the weights are read by conv_transpose alone. */
static bool only_transposed(const ts_conv *c, ts_conv_use use)
{
    return use == TS_CONV_WINOGRAD || use == TS_CONV_WINOGRAD_BF16 ||
        (use == TS_CONV_FORWARD_BF16 && !conv_amx_present()) ||
        (use == TS_CONV_FORWARD && conv_choose_narrow(c->ic, c->oc, c->k) == TS_CONV_DIRECTLY);
}

static void pack(const ts_conv *c, ts_conv_use use, const conv_weights *w, float *packed)
{
    if (use == TS_CONV_WINOGRAD || use == TS_CONV_DATA_GRADIENT_WINOGRAD) {
        conv_winograd_pack(c, use == TS_CONV_WINOGRAD, false, w, packed);
        return;
    }
    if (use == TS_CONV_WINOGRAD_BF16 || use == TS_CONV_DATA_GRADIENT_WINOGRAD_BF16) {
        conv_winograd_pack(c, use == TS_CONV_WINOGRAD_BF16, true, w, packed);
        return;
    }
    if (use == TS_CONV_FORWARD_BF16 || use == TS_CONV_DATA_GRADIENT_BF16) {
        conv_pack_bf16(c, use == TS_CONV_FORWARD_BF16, w, packed);
        return;
    }
    const bool forward = use == TS_CONV_FORWARD;
    const int ic = forward ? c->ic : c->oc, oc = forward ? c->oc : ts_conv_variables(c), taps = c->k * c->k;
    const ptrdiff_t o_step = forward ? (ptrdiff_t)c->ic * taps : taps,
                    i_step = forward ? taps : (ptrdiff_t)c->ic * taps;
    pack_panels(c, w, forward, packed);
    /* Behind the panels once more, for the ways of few output channels. */
    const ts_conv_way narrow = conv_choose_narrow(ic, oc, c->k);
    float *behind = packed + conv_panels_count(ic, oc, c->k);
    if (narrow == TS_CONV_BY_COL2IM) conv_pack_col2im(ic, oc, c->k, !forward, w->full, i_step, o_step, behind);
    if (narrow == TS_CONV_BY_PIXEL_LANES)
        conv_pack_pixel_lanes(ic, oc, c->k, !forward, w->full, i_step, o_step, behind);
}

void ts_conv_pack(const ts_conv *c, ts_conv_use use, const float *weight, float *packed)
{
    pack(c, use, &(conv_weights){.full = weight}, packed);
}

bool ts_conv_pack_half(const ts_conv *c, ts_conv_use use, const void *weight, float *packed)
{
    conv_weights w = {.half = weight};
    float *full = NULL;
    if (!only_transposed(c, use)) {
        const ptrdiff_t count = (ptrdiff_t)c->oc * c->ic * c->k * c->k;
        if (!(full = malloc(sizeof *full * (size_t)count))) return false;
        for (ptrdiff_t i = 0; i < count; i += CONV_TRANSPOSED)
            conv_take(&w, i, (int)(count - i < CONV_TRANSPOSED ? count - i : CONV_TRANSPOSED), full + i);
        w = (conv_weights){.full = full};
    }
    pack(c, use, &w, packed);
    free(full);
    return true;
}
