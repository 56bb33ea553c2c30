/* Packed weights. Those of a panel's outputs are read as they stand, some inputs of each, and turned round in the first
 * cache: from number to number they would be a page apart. */
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
    return panels + (narrow == TS_CONV_BY_LANES ? (size_t)ic * (size_t)oc * (size_t)(c->k * c->k) : 0);
}

static void take(const conv_weights *w, ptrdiff_t at, int count, float *to)
{
    uint16_t part[CONV_TURNED]; /* a file's halves are not aligned */
    if (w->full) {
        memcpy(to, w->full + at, sizeof *to * (size_t)count);
        return;
    }
    memcpy(part, w->half + 2 * at, sizeof *part * (size_t)count);
    ts_elementwise_k()->from_half(count, part, to);
}

int conv_turn(const ts_conv *c, const conv_weights *w, bool forward, int panel, int input, int inputs, float *to)
{
    const int oc = forward ? c->oc : ts_conv_variables(c), width = conv_vectors(oc, panel) * conv_lanes(),
              o0 = panel * 2 * conv_lanes(), count = oc - o0 < width ? oc - o0 : width, taps = c->k * c->k;
    float rows[2 * 16 * CONV_TURNED]; /* no vector has more than 16 lanes */
    /* weight[o][i][tap], or of the gradient, whose inputs are the outputs, weight[i][o][tap] */
    const int columns = forward ? inputs * taps : taps;
    if (!forward && taps == 1) { /* in order already */
        for (int i = 0; i < inputs; i++) {
            take(w, (ptrdiff_t)(input + i) * c->ic + o0, count, to + i * width);
            memset(to + i * width + count, 0, sizeof *to * (size_t)(width - count));
        }
        return width;
    }
    for (int i = 0; i < (forward ? 1 : inputs); i++) {
        if (forward)
            for (int o = 0; o < count; o++)
                take(w, ((ptrdiff_t)(o0 + o) * c->ic + input) * taps, columns, rows + o * columns);
        else
            for (int o = 0; o < count; o++)
                take(w, ((ptrdiff_t)(input + i) * c->ic + o0 + o) * taps, columns, rows + o * columns);
        memset(rows + count * columns, 0, sizeof *rows * (size_t)((width - count) * columns));
        ts_conv_k()->transpose(rows, width, columns, to + (ptrdiff_t)i * taps * width, width);
    }
    return width;
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
    float turned[2 * 16 * CONV_TURNED];
    const int begin = part * j->step, count = j->ic - begin < j->step ? j->ic - begin : j->step;
    const int width = conv_turn(j->c, j->w, j->forward, panel, begin, count, turned);
    float *to = j->packed + (ptrdiff_t)panel * 2 * conv_lanes() * j->ic * j->taps;
    for (int t = 0; t < j->taps; t++)
        for (int i = 0; i < count; i++)
            memcpy(to + ((ptrdiff_t)t * j->ic + begin + i) * width,
                   turned + (i * j->taps + (j->forward ? t : j->taps - 1 - t)) * width, sizeof *to * (size_t)width);
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
    const int step = conv_turned_inputs(taps), parts = (ic + step - 1) / step;
    ts_for(c->compute.threads, (int64_t)conv_panels(oc) * parts, 1, pack_parts,
           &(panels_job){c, w, forward, ic, taps, step, parts, packed});
}

/* Whether the weights are read by conv_turn alone. */
static bool only_turned(const ts_conv *c, ts_conv_use use)
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
    if (narrow == TS_CONV_BY_LANES) conv_pack_lanes(ic, oc, c->k, !forward, w->full, i_step, o_step, behind);
}

void ts_conv_pack(const ts_conv *c, ts_conv_use use, const float *weight, float *packed)
{
    pack(c, use, &(conv_weights){.full = weight}, packed);
}

bool ts_conv_pack_half(const ts_conv *c, ts_conv_use use, const void *weight, float *packed)
{
    conv_weights w = {.half = weight};
    float *full = NULL;
    if (!only_turned(c, use)) {
        const ptrdiff_t count = (ptrdiff_t)c->oc * c->ic * c->k * c->k;
        if (!(full = malloc(sizeof *full * (size_t)count))) return false;
        for (ptrdiff_t i = 0; i < count; i += CONV_TURNED)
            take(&w, i, (int)(count - i < CONV_TURNED ? count - i : CONV_TURNED), full + i);
        w = (conv_weights){.full = full};
    }
    pack(c, use, &w, packed);
    free(full);
    return true;
}
