/* Kernels of side 1: a matrix product over all pixels, without a window. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/threads.h"

/* Side 1: all pixels of all images are one row, read where they are, or from a chunk as bf16. */
void conv_run_pointwise(const conv_plan *p)
{
    const ptrdiff_t pixels = (ptrdiff_t)p->n * p->h * p->w;
    const int panels = conv_panels(p->oc), chunk = 16 * ts_conv_k()->pixels;
    const int chunks = (int)((pixels + chunk - 1) / chunk);
    int groups = chunks < 8 ? (8 + chunks - 1) / chunks : 1;
    if (groups > panels) groups = panels;
#pragma omp parallel for collapse(2) schedule(dynamic) num_threads(ts_threads_of(p->threads))
    for (int g = 0; g < groups; g++)
        for (int i = 0; i < chunks; i++) {
            int panel0, panel1;
            conv_part(panels, groups, g, &panel0, &panel1);
            const ptrdiff_t first = (ptrdiff_t)i * chunk, count = pixels - first < chunk ? pixels - first : chunk;
            if (!p->bf16) {
                conv_run_pixels(p, first, count, panel0, panel1);
                continue;
            }
            conv_plan now = *p;
            float *x = ts_scratch(0, sizeof(float) * (size_t)chunk * (size_t)p->ic);
            conv_put_pixels(p, p->x + first * p->channels, count, x, p->ic);
            now.x = x;
            now.y = p->y + first * p->oc;
            conv_run_pixels(&now, 0, count, panel0, panel1);
        }
}
