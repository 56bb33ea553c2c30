/* Small maps in a batch: tiles run over the images at one position, so that nothing is padded. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"

/* What a thread has of its own. */
typedef struct own {
    float *gathered; /* x as [position][image][channel] */
    ptrdiff_t pixel;
    ts_segment *segment;
    conv_pair *row, *column;
} own;

static own prepare(const conv_plan *p)
{
    const int most = conv_pairs_max(p), positions = p->h * p->w;
    own o = {.pixel = p->ic % 512 ? p->ic : p->ic + 16};
    const ptrdiff_t image = (ptrdiff_t)positions * p->channels;
    o.gathered = ts_scratch(0, sizeof(float) * (size_t)(positions * o.pixel) * (size_t)p->n);
    for (int q = 0; q < positions; q++)
        for (int n = 0; n < p->n; n++)
            conv_put_pixels(p, p->x + n * image + (ptrdiff_t)q * p->channels, 1,
                            o.gathered + ((ptrdiff_t)q * p->n + n) * o.pixel, o.pixel);
    char *memory = ts_scratch(1, sizeof(conv_pair) * (size_t)(2 * most) + sizeof(ts_segment) * (size_t)(most * most));
    o.segment = (ts_segment *)(void *)memory;
    o.row = (conv_pair *)(void *)(o.segment + most * most);
    o.column = o.row + most;
    return o;
}

static void run_line(const conv_plan *p, const own *o, int panel, int i)
{
    const int tiles = (p->n + ts_conv_k()->pixels - 1) / ts_conv_k()->pixels, rows = conv_pairs(p, i, p->h, o->row);
    ts_tile t = conv_panel_tile(p, panel);
    t.segment = o->segment;
    t.a_stride = o->pixel;
    t.y_stride = (ptrdiff_t)p->h * p->w * p->oc;
    for (int j = 0; j < p->w; j++) {
        const int columns = conv_pairs(p, j, p->w, o->column);
        t.segments = 0;
        for (int a = 0; a < rows; a++)
            for (int b = 0; b < columns; b++)
                o->segment[t.segments++] = (ts_segment){
                    ((ptrdiff_t)o->row[a].source * p->w + o->column[b].source) * p->n * o->pixel,
                    ((ptrdiff_t)o->row[a].tap * p->k + o->column[b].tap) * p->ic, p->ic};
        float *y = p->y + ((ptrdiff_t)i * p->w + j) * p->oc + panel * 2 * conv_lanes();
        for (int tile = 0; tile < tiles; tile++) {
            int begin, end;
            conv_part(p->n, tiles, tile, &begin, &end);
            conv_run_tile(&t, conv_vectors(p->oc, panel), o->gathered + begin * o->pixel, y + begin * t.y_stride,
                          end - begin, p->bf16);
        }
    }
}

static void run_lines(const void *plan, ts_queue *queue)
{
    const conv_plan *p = plan;
    int64_t i, end;
    if (!ts_next(queue, &i, &end)) return;
    const own o = prepare(p);
    do run_line(p, &o, (int)(i / p->h), (int)(i % p->h));
    while (ts_next(queue, &i, &end));
}

/* Small images: a tile is one position in several images, and only taps that meet an input are multiplied. */
void conv_run_batch(const conv_plan *p)
{
    ts_share_tasks(p->threads, TS_SPREAD, (int64_t)conv_panels(p->oc) * p->h, 1, run_lines, p);
}
