/* The weights of a panel's outputs are read as they stand, some inputs of each, and transposed: from number to number
 * they would be a page apart. Halves, and panels that are not full, are copied first. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/elementwise.h"
#include <string.h>

void conv_take(const conv_weights *w, ptrdiff_t at, int count, float *to)
{
    if (w->full) memcpy(to, w->full + at, sizeof *to * (size_t)count);
    else ts_elementwise_k()->from_half(count, w->half + 2 * at, to);
}

int conv_transpose(const ts_conv *c, const conv_weights *w, bool forward, int panel, int input, int inputs, float *to)
{
    const int oc = forward ? c->oc : ts_conv_variables(c), width = conv_vectors(oc, panel) * conv_lanes(),
              o0 = panel * 2 * conv_lanes(), count = oc - o0 < width ? oc - o0 : width, taps = c->k * c->k;
    float rows[2 * 16 * CONV_TRANSPOSED]; /* no vector has more than 16 lanes */
    /* weight[o][i][tap], or of the gradient, whose inputs are the outputs, weight[i][o][tap] */
    const int columns = forward ? inputs * taps : taps;
    if (!forward && taps == 1) { /* in order already */
        for (int i = 0; i < inputs; i++) {
            conv_take(w, (ptrdiff_t)(input + i) * c->ic + o0, count, to + i * width);
            memset(to + i * width + count, 0, sizeof *to * (size_t)(width - count));
        }
        return width;
    }
    const ptrdiff_t stride = forward ? (ptrdiff_t)c->ic * taps : taps; /* from output to output */
    for (int i = 0; i < (forward ? 1 : inputs); i++) {
        const ptrdiff_t at = forward ? o0 * stride + (ptrdiff_t)input * taps
                                     : ((ptrdiff_t)(input + i) * c->ic + o0) * taps;
        float *turned = to + (ptrdiff_t)i * taps * width;
        if (w->full && count == width) {
            ts_conv_k()->transpose(w->full + at, stride, width, columns, turned, width);
            continue;
        }
        for (int o = 0; o < count; o++) conv_take(w, at + o * stride, columns, rows + o * columns);
        memset(rows + count * columns, 0, sizeof *rows * (size_t)((width - count) * columns));
        ts_conv_k()->transpose(rows, columns, width, columns, turned, width);
    }
    return width;
}
