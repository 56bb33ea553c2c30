/* Convolutions whose tiles need no padded rows: kernels of side 1, and small images. */
#include "tensor/conv/conv_internal.h"
#include "tensor/threads.h"

enum { PANELS_TOGETHER = 8 };

/* Panels [panel0, panel1), at most PANELS_TOGETHER of them. */
static void run_together(const conv_plan *p, ptrdiff_t first, ptrdiff_t count, int panel0, int panel1)
{
    const ptrdiff_t tiles = (count + ts_conv_k()->pixels - 1) / ts_conv_k()->pixels,
                    step = (count + tiles - 1) / tiles; /* a short last tile would wait for its own sums */
    const ptrdiff_t panels = panel1 - panel0, calls = (p->ic + 3) / 4;
    const ts_segment segment = {0, 0, p->ic};
    ts_tile tile[PANELS_TOGETHER];
    /* Each panel fetches its share of the next tile's input and output: few k leave no time to wait for memory. */
    const ptrdiff_t x_part = step * p->ic / panels, y_part = step * p->oc / panels;
    for (int i = 0; i < panels; i++) {
        tile[i] = conv_panel_tile(p, panel0 + i);
        tile[i].segment = &segment;
        tile[i].segments = 1;
        tile[i].a_stride = p->ic;
        tile[i].fetch_step[0] = x_part * (ptrdiff_t)sizeof(float) / calls;
        tile[i].fetch_step[1] = y_part * (ptrdiff_t)sizeof(float) / calls;
    }
    for (ptrdiff_t j = 0; j < count; j += step) {
        const float *x = p->x + (first + j) * p->ic;
        float *y = p->y + (first + j) * p->oc;
        for (int i = 0; i < panels; i++) {
            tile[i].fetch[0] = x + step * p->ic + i * x_part;
            tile[i].fetch[1] = y + step * p->oc + i * y_part;
            conv_run_tile(&tile[i], conv_vectors(p->oc, panel0 + i), x, y + (panel0 + i) * 2 * conv_lanes(),
                          (int)(count - j < step ? count - j : step), p->bf16);
        }
    }
}

void conv_run_pixels(const conv_plan *p, ptrdiff_t first, ptrdiff_t count, int panel0, int panel1)
{
    ptrdiff_t together = CONV_BLOCK_BYTES / ((ptrdiff_t)p->ic * 2 * conv_lanes() * (ptrdiff_t)sizeof(float));
    if (together < 1) together = 1;
    if (together > PANELS_TOGETHER) together = PANELS_TOGETHER;
    for (int base = panel0; base < panel1; base += (int)together)
        run_together(p, first, count, base, base + together < panel1 ? base + (int)together : panel1);
}

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

/* Small images: a tile is one position in several images, and only taps that meet an input are multiplied. */
void conv_run_positions(const conv_plan *p)
{
    const int panels = conv_panels(p->oc), most = conv_pairs_max(p), positions = p->h * p->w;
    const ptrdiff_t pixel = p->ic % 512 ? p->ic : p->ic + 16;
    const ptrdiff_t image = (ptrdiff_t)positions * p->channels;
    const int tiles = (p->n + ts_conv_k()->pixels - 1) / ts_conv_k()->pixels;
#pragma omp parallel num_threads(ts_threads_of(p->threads))
    {
        /* x as [position][image][channel] */
        float *staged = ts_scratch(0, sizeof(float) * (size_t)(positions * pixel) * (size_t)p->n);
        for (int q = 0; q < positions; q++)
            for (int n = 0; n < p->n; n++)
                conv_put_pixels(p, p->x + n * image + (ptrdiff_t)q * p->channels, 1,
                                staged + ((ptrdiff_t)q * p->n + n) * pixel, pixel);
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
                        conv_run_tile(&t, conv_vectors(p->oc, panel), staged + begin * pixel, y + begin * t.y_stride,
                                      end - begin, p->bf16);
                    }
                }
            }
    }
}
