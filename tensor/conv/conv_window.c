/* Rows of input with their padding, and which taps meet which inputs. */
#include "tensor/conv/plan.h"
#include "tensor/kernels/pairs.h"
#include <string.h>

conv_window conv_window_make(const conv_plan *p, int rows, int left, int columns)
{
    conv_window s = {.rows = rows < p->h ? rows : p->h, .left = left, .columns = columns};
    /* Strides of a multiple of 2 KiB put all pixels of a tile into two sets of the first cache. */
    s.pixel = p->ic % 512 ? p->ic : p->ic + 16;
    s.row = s.columns * s.pixel;
    if (s.row % 1024 == 0) s.row += 16;
    return s;
}

void conv_put_pixels(const conv_plan *p, const float *from, ptrdiff_t n, float *to, ptrdiff_t stride)
{
    if (p->bf16) ts_pairs_k()->of_channels(from, n, p->channels, to, stride);
    else if (stride == p->ic) memcpy(to, from, sizeof(float) * (size_t)n * (size_t)p->ic);
    else
        for (ptrdiff_t j = 0; j < n; j++) memcpy(to + j * stride, from + j * p->ic, sizeof(float) * (size_t)p->ic);
}

/* n pixels: copies of one, or zeros where from is NULL. */
static void fill_pixels(const conv_window *s, const conv_plan *p, float *to, const float *from, int n)
{
    for (int j = 0; j < n; j++, to += s->pixel) {
        if (from) conv_put_pixels(p, from, 1, to, s->pixel);
        else memset(to, 0, sizeof(float) * (size_t)p->ic);
    }
}

void conv_window_fill(conv_window *s, const conv_plan *p, int n, int first, int last)
{
    /* Columns [left, left + columns): before the image, in it, behind it. */
    const int end = s->left + s->columns;
    const int begin_in = s->left > 0 ? s->left : 0, end_in = end < p->w ? end : p->w;
    const int before = (end < 0 ? end : 0) - s->left, inside = end_in - begin_in,
              behind = end - (s->left > p->w ? s->left : p->w);
    for (int r = s->next > first ? s->next : first; r <= last; r++) {
        float *to = s->memory + r % s->rows * s->row;
        const float *from = p->x + ((ptrdiff_t)n * p->h + r) * p->w * p->channels;
        fill_pixels(s, p, to, p->replicate ? from : NULL, before);
        if (inside > 0)
            conv_put_pixels(p, from + (ptrdiff_t)begin_in * p->channels, inside, to + (begin_in - s->left) * s->pixel,
                            s->pixel);
        fill_pixels(s, p, to + (s->columns - behind) * s->pixel,
                    p->replicate ? from + (ptrdiff_t)(p->w - 1) * p->channels : NULL, behind);
    }
    if (last >= s->next) s->next = last + 1;
}

int conv_pairs(const conv_plan *p, int i, int size, conv_pair *pair)
{
    int count = 0;
    const int begin = i == 0 ? -p->fold : i, end = i == size - 1 ? i + p->fold : i;
    for (int t = 0; t < p->k; t++)
        for (int e = begin; e <= end; e++) {
            int s = e + p->fold + p->first + t * p->dilation;
            if (p->replicate) s = conv_clamp(s, size);
            if (s >= 0 && s < size) pair[count++] = (conv_pair){s, t};
        }
    return count;
}
