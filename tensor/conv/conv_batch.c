/* Small maps in a batch: tiles run over the images at one position, so that nothing is padded. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/threads.h"

/* Small images: a tile is one position in several images, and only taps that meet an input are multiplied. */
void conv_run_batch(const conv_plan *p)
{
    const int panels = conv_panels(p->oc), most = conv_pairs_max(p), positions = p->h * p->w;
    const ptrdiff_t pixel = p->ic % 512 ? p->ic : p->ic + 16;
    const ptrdiff_t image = (ptrdiff_t)positions * p->channels;
    const int tiles = (p->n + ts_conv_k()->pixels - 1) / ts_conv_k()->pixels;
#pragma omp parallel num_threads(ts_threads_of(p->threads))
    {
        /* x as [position][image][channel] */
        float *gathered = ts_scratch(0, sizeof(float) * (size_t)(positions * pixel) * (size_t)p->n);
        for (int q = 0; q < positions; q++)
            for (int n = 0; n < p->n; n++)
                conv_put_pixels(p, p->x + n * image + (ptrdiff_t)q * p->channels, 1,
                                gathered + ((ptrdiff_t)q * p->n + n) * pixel, pixel);
        char *memory = ts_scratch(1,
                                  sizeof(conv_pair) * (size_t)(2 * most) + sizeof(ts_segment) * (size_t)(most * most));
        ts_segment *segment = (ts_segment *)(void *)memory;
        conv_pair *row = (conv_pair *)(void *)(segment + most * most), *column = row + most;
#pragma omp for collapse(2) schedule(dynamic)
        for (int panel = 0; panel < panels; panel++)
            for (int i = 0; i < p->h; i++) {
                ts_tile t = conv_panel_tile(p, panel);
                const int rows = conv_pairs(p, i, p->h, row);
                t.segment = segment;
                t.a_stride = pixel;
                t.y_stride = (ptrdiff_t)positions * p->oc;
                for (int j = 0; j < p->w; j++) {
                    const int columns = conv_pairs(p, j, p->w, column);
                    t.segments = 0;
                    for (int a = 0; a < rows; a++)
                        for (int b = 0; b < columns; b++)
                            segment[t.segments++] = (ts_segment){
                                ((ptrdiff_t)row[a].source * p->w + column[b].source) * p->n * pixel,
                                ((ptrdiff_t)row[a].tap * p->k + column[b].tap) * p->ic, p->ic};
                    float *y = p->y + ((ptrdiff_t)i * p->w + j) * p->oc + panel * 2 * conv_lanes();
                    for (int tile = 0; tile < tiles; tile++) {
                        int begin, end;
                        conv_part(p->n, tiles, tile, &begin, &end);
                        conv_run_tile(&t, conv_vectors(p->oc, panel), gathered + begin * pixel, y + begin * t.y_stride,
                                      end - begin, p->bf16);
                    }
                }
            }
    }
}
